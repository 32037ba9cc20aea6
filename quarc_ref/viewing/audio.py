"""Reads the audio file of a page, or extracts it from a video."""

from pathlib import Path

from quarc_ref.viewing.page import PageAudio

_MAX_BYTES = 1 << 29
_HEAD_BYTES = 12  # by which formats are recognized
# with which mp4 and mov begin
_VIDEO_BOXES = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip")
_MATROSKA_MAGIC = b"\x1a\x45\xdf\xa3"
_MEDIA_TYPES = {
    "aac": "audio/aac",
    "flac": "audio/flac",
    "m4a": "audio/mp4",
    "mp3": "audio/mpeg",
    "ogg": "audio/ogg",
    "wav": "audio/wav",
    "webm": "audio/webm",
}


class AudioFileError(ValueError):
    """A file cannot be the audio of a page."""


def read_audio(path: Path, start: float) -> PageAudio:
    """Read an audio file, or extract the sound of a video.

    Args:
        path: Path of the file. m4a files are treated like videos, which needs the extra `media`.
        start: Time in the file of the frame with ordinal 0, seconds; in a video, the time after its
            first picture.

    Raises:
        AudioFileError: The path is not a file, or the file is neither audio nor a video, or it is
            too large.
        CaptureError: The sound of the video cannot be read.
        OSError: The file cannot be read.
    """
    if not path.is_file():
        message = f"{path} is not a file" if path.exists() else f"{path} does not exist"
        raise AudioFileError(message)
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
        if _is_video(head):
            return _extract_audio(path, start)
        suffix = _recognize(head)
        if suffix is None:
            message = (
                f"{path} is neither an audio file (mp3, m4a, aac, ogg, opus, wav or flac) nor a "
                "video (mp4, mov, mkv or webm)"
            )
            raise AudioFileError(message)
        data = head + file.read(_MAX_BYTES)
    if len(data) > _MAX_BYTES:
        message = f"{path} has more than {_MAX_BYTES >> 20} MiB: convert it to m4a"
        raise AudioFileError(message)
    return PageAudio(data, f"audio.{suffix}", _MEDIA_TYPES[suffix], start)


def _extract_audio(path: Path, start: float) -> PageAudio:
    from quarc_ref.datasets.sound_track import extract_sound_track

    track = extract_sound_track(path)
    name = f"audio.{track.suffix}"
    return PageAudio(track.data, name, _MEDIA_TYPES[track.suffix], start - track.start)


def _is_video(head: bytes) -> bool:
    return head[4:8] in _VIDEO_BOXES or head.startswith(_MATROSKA_MAGIC)


def _recognize(head: bytes) -> str | None:
    """Return the suffix of an audio format by the first bytes of a file; None if unknown."""
    is_mpeg = head[:1] == b"\xff" and len(head) == _HEAD_BYTES
    formats = {
        "wav": head[:4] == b"RIFF" and head[8:] == b"WAVE",
        "ogg": head.startswith(b"OggS"),
        "flac": head.startswith(b"fLaC"),
        "aac": is_mpeg and head[1] & 0xF6 == 0xF0,
        "mp3": head.startswith(b"ID3") or (is_mpeg and head[1] & 0xE6 == 0xE2),  # layer III
    }
    return next((suffix for suffix, is_format in formats.items() if is_format), None)
