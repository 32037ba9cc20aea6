"""Opens every picture and video file that FFmpeg reads.

FFmpeg opens more than files. It takes names for addresses, and text for
playlists that name other files and hosts. From here it gets regular files of
this machine alone, in the formats that captures have; and its decoders decline
pictures that are too large before they allocate them, in mid-stream as well.
"""

import stat
from pathlib import Path

import av
from av.container import InputContainer
from av.video.stream import VideoStream

from quarc_ref.datasets.calibration import MOST_PIXELS, require_picture_size
from quarc_ref.datasets.errors import MissingFileError, TruncatedVideoError, UnreadableVideoError
from quarc_ref.datasets.still_header import UPRIGHT, StillHeader, read_still_header

_DEMUXERS = "mov,matroska"  # mp4, mov, m4v; mkv, webm
_THREADS = 4  # every camera has a decoder of its own, so a few each are plenty
_MOST_STILL_BYTES = 1 << 29
# Decoders pad both sides before they ask; the size itself is checked by the header.
_DECODER_LIMITS = {"max_pixels": str(MOST_PIXELS * 9 // 8)}
_STRICT = {"err_detect": "crccheck+explode"}


def open_video(path: Path) -> tuple[InputContainer, VideoStream]:
    """Open a video to demux and decode its first video stream.

    Args:
        path: Path of an mp4, mov, mkv or webm file.

    Returns:
        The container, and the stream in it.

    Raises:
        MissingFileError: The file does not exist, or cannot be read.
        TruncatedVideoError: The file breaks off before its table of frames.
        UnreadableVideoError: The path is not a regular file, not a supported video, or its
            pictures are too large.
    """
    _require_regular_file(path)
    # After "file:", no part of a name means anything. Demuxers that would open
    # further files are not allowed; if one did all the same, no host is reached.
    options = {"format_whitelist": _DEMUXERS, "protocol_whitelist": "file", **_DECODER_LIMITS}
    try:
        container = av.open(f"file:{path}", options=options)
    except av.EOFError as error:
        message = f"{path} breaks off before its table of frames: copy or export it again"
        raise TruncatedVideoError(message) from error
    except av.FFmpegError as error:
        reason = error.strerror
        message = f"{path} cannot be opened as mp4, mov, mkv or webm ({reason}): export it again"
        raise UnreadableVideoError(message) from error
    return container, _prepare_stream(container, path)


def decode_still(path: Path, size: tuple[int, int] | None = None) -> av.VideoFrame:
    """Return the picture of a PNG or JPEG file.

    Args:
        path: Path of the file.
        size: Width and height that the picture must have, pixels; None for any.

    Raises:
        MissingFileError: The file does not exist, or cannot be read.
        UnreadableVideoError: The path is not a regular file, not a supported picture, of another
            size, damaged, or has an EXIF orientation.
    """
    data = _read_still(path)
    header = _require_usable(path, data, size)
    # A decoder by itself: no demuxer sees the file, and no protocol its name.
    decoder = av.CodecContext.create(header.codec, "r")
    decoder.options = _DECODER_LIMITS | _STRICT
    try:
        frames = [*decoder.decode(av.Packet(data)), *decoder.decode(None)]
    except av.FFmpegError as error:
        message = f"{path} cannot be decoded as a picture ({error.strerror}): export it again"
        raise UnreadableVideoError(message) from error
    if not frames:
        message = f"{path} cannot be decoded as a picture (it holds none): export it again"
        raise UnreadableVideoError(message)
    return frames[0]


def read_still_size(path: Path) -> tuple[int, int]:
    """Return width and height of a PNG or JPEG file, pixels, by its header.

    Raises:
        MissingFileError: The file does not exist, or cannot be read.
        UnreadableVideoError: The path is not a regular file, or not a supported picture.
    """
    header = _require_usable(path, _read_still(path), None)
    return header.width, header.height


def _require_regular_file(path: Path) -> int:
    """Return the size of a file, bytes, which has an end and can be opened without waiting."""
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        message = f"{path} is missing or cannot be opened: {error}"
        raise MissingFileError(message) from error
    if not stat.S_ISREG(status.st_mode):
        message = f"{path} is not a regular file"
        raise UnreadableVideoError(message)
    return status.st_size


def _prepare_stream(container: InputContainer, path: Path) -> VideoStream:
    if not container.streams.video:
        message = f"{path} has no video in it"
        raise UnreadableVideoError(message)
    stream = container.streams.video[0]
    if not hasattr(stream, "width"):  # which is the decoder's
        message = f"{path} has a video that there is no decoder for: export it again as H.264"
        raise UnreadableVideoError(message)
    if not (stream.average_rate and stream.width and stream.height):
        message = (
            f"{path} does not say its frame rate or size, or has more than {MOST_PIXELS:,} pixels "
            "a frame: export it again as mp4"
        )
        raise UnreadableVideoError(message)
    try:
        require_picture_size(stream.width, stream.height)
    except ValueError as error:
        message = f"{path}: {error}"
        raise UnreadableVideoError(message) from error
    stream.thread_type = "AUTO"
    stream.codec_context.thread_count = _THREADS
    stream.codec_context.options = _DECODER_LIMITS
    return stream


def _read_still(path: Path) -> bytes:
    if _require_regular_file(path) > _MOST_STILL_BYTES:
        message = f"{path} has more than {_MOST_STILL_BYTES:,} bytes: export it again"
        raise UnreadableVideoError(message)
    try:
        return path.read_bytes()
    except OSError as error:
        message = f"{path} cannot be read: {error}"
        raise MissingFileError(message) from error


def _require_usable(path: Path, data: bytes, size: tuple[int, int] | None) -> StillHeader:
    """Return the header of a picture file that can be decoded and used as stored."""
    try:
        header = read_still_header(data)
        require_picture_size(header.width, header.height)
    except ValueError as error:
        message = f"{path} cannot be decoded as a picture ({error}): export it again"
        raise UnreadableVideoError(message) from error
    if size is not None and size != (header.width, header.height):
        message = (
            f"{path} is {header.width}x{header.height}, but its calibration is for "
            f"{size[0]}x{size[1]}: scale one to the other"
        )
        raise UnreadableVideoError(message)
    if header.orientation != UPRIGHT:
        # COLMAP and nerfstudio calibrate the pixels as stored, OpenCV as shown. Which of
        # them the poses are for, no file says, and half a turn does not change the size.
        message = (
            f"{path} has EXIF orientation {header.orientation}, which some tools apply and some "
            "ignore: remove the tag if the poses are for the pixels as stored (exiftool "
            "-Orientation= FILE), else turn the pixels (mogrify -auto-orient FILE)"
        )
        raise UnreadableVideoError(message)
    return header
