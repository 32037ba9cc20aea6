"""Opens pictures and videos for FFmpeg; no other module passes file names to FFmpeg.

FFmpeg can also open URLs, and playlists that refer to other files and hosts. The functions in this
module restrict FFmpeg to regular local files in the formats that captures use. The functions also
make the decoders reject oversized pictures before allocating memory, even if the picture size
changes in the middle of a video.
"""

import stat
from pathlib import Path

import av
from av.audio.stream import AudioStream
from av.container import InputContainer
from av.stream import Disposition
from av.video.stream import VideoStream

from quarc_ref.datasets.calibration import MAX_PIXELS, require_picture_size
from quarc_ref.datasets.cut_files import lacks_frame_table
from quarc_ref.datasets.errors import MissingFileError, TruncatedVideoError, UnreadableVideoError
from quarc_ref.datasets.still_header import UPRIGHT, StillHeader, read_still_header

_DEMUXERS = "mov,matroska"  # "mov" reads mp4, mov and m4v; "matroska" reads mkv and webm
_DECODER_THREADS = 4  # Every camera has its own decoder, so four threads per decoder are enough.
_MAX_STILL_BYTES = 1 << 29
# Decoders compare the limit with the padded size, so the limit exceeds the maximum picture size.
_DECODER_LIMITS = {"max_pixels": str(MAX_PIXELS * 9 // 8)}
_STRICT_OPTIONS = {"err_detect": "crccheck+explode"}


def open_video(path: Path) -> tuple[InputContainer, VideoStream]:
    """Open a video file, and prepare its first video stream for demuxing and decoding.

    Args:
        path: Path of an mp4, mov, mkv or webm file.

    Returns:
        The container and its first video stream that is not an attached picture.

    Raises:
        MissingFileError: The file does not exist, or cannot be read.
        TruncatedVideoError: The file ends before the end of its frame table.
        UnreadableVideoError: The path is not a regular file or not a supported video, or the
            pictures are too large.
    """
    container = open_media(path)
    try:
        return container, _prepare_stream(container, path)
    except UnreadableVideoError as error:
        if lacks_frame_table(path):  # FFmpeg opens a file that ends within the table.
            raise _make_truncation_error(path) from error
        raise


def open_media(path: Path) -> InputContainer:
    """Open a file that has video or sound.

    Args:
        path: Path of an mp4, m4a, mov, mkv or webm file.

    Raises:
        MissingFileError: The file does not exist, or cannot be read.
        TruncatedVideoError: The file is empty, or ends before its frame table.
        UnreadableVideoError: The path is not a regular file or not a supported video.
    """
    if not _require_regular_file(path):
        message = f"{path} is empty: copy it from the camera again, or remove it"
        raise TruncatedVideoError(message)
    # After "file:", FFmpeg interprets no part of a name. Demuxers that would open further files are
    # not allowed, and network protocols are disabled as well.
    options = {"format_whitelist": _DEMUXERS, "protocol_whitelist": "file", **_DECODER_LIMITS}
    try:
        return av.open(f"file:{path}", options=options)
    except av.FFmpegError as error:
        if isinstance(error, av.EOFError) or lacks_frame_table(path):
            raise _make_truncation_error(path) from error
        reason = error.strerror
        message = f"{path} cannot be opened as mp4, mov, mkv or webm ({reason}): export it again"
        raise UnreadableVideoError(message) from error


def find_video_stream(container: InputContainer) -> VideoStream | None:
    """Return the first video stream of a file; None if it has only attached pictures or sound."""
    streams = container.streams.video
    return next((s for s in streams if not s.disposition & Disposition.attached_pic), None)


def find_audio_stream(container: InputContainer, path: Path) -> AudioStream | None:
    """Return the first sound of a file that has a decoder; None if the file has no sound.

    Some phones record spatial audio in a format of their own, next to sound for other players.

    Args:
        container: The opened file.
        path: Path of the file, for error messages.

    Raises:
        UnreadableVideoError: FFmpeg has no decoder for any sound of the file.
    """
    streams = container.streams.audio
    for stream in streams:
        if hasattr(stream, "codec"):  # The attribute is missing if FFmpeg has no decoder.
            return stream
    if not streams:
        return None
    message = f"no decoder is available for the sound of {path}: export it again as AAC"
    raise UnreadableVideoError(message)


def decode_still(path: Path, size: tuple[int, int] | None = None) -> av.VideoFrame:
    """Decode a PNG or JPEG file.

    Args:
        path: Path of the file.
        size: Width and height that the picture must have, pixels; None for any.

    Raises:
        MissingFileError: The file does not exist, or cannot be read.
        UnreadableVideoError: The path is not a regular file or not a supported picture, or the
            picture is damaged, has a different size, or has an EXIF orientation.
    """
    data = _read_still(path)
    header = _require_usable_still(path, data, size)
    # The decoder is called directly, so that no demuxer or protocol of FFmpeg opens the file.
    decoder = av.CodecContext.create(header.codec, "r")
    decoder.options = _DECODER_LIMITS | _STRICT_OPTIONS
    try:
        frames = [*decoder.decode(av.Packet(data)), *decoder.decode(None)]
    except av.FFmpegError as error:
        message = f"{path} cannot be decoded as a picture ({error.strerror}): export it again"
        raise UnreadableVideoError(message) from error
    if not frames:
        message = f"{path} cannot be decoded as a picture (it is empty): export it again"
        raise UnreadableVideoError(message)
    return frames[0]


def read_still_size(path: Path) -> tuple[int, int]:
    """Read the width and height, in pixels, from the header of a PNG or JPEG file.

    Raises:
        MissingFileError: The file does not exist, or cannot be read.
        UnreadableVideoError: The path is not a regular file, or not a supported picture.
    """
    header = _require_usable_still(path, _read_still(path), None)
    return header.width, header.height


def _require_regular_file(path: Path) -> int:
    """Return the size of a file in bytes; raise an error if the path is not a regular file."""
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        message = f"{path} is missing or cannot be opened: {reason}"
        raise MissingFileError(message) from error
    if not stat.S_ISREG(status.st_mode):
        message = f"{path} is not a regular file"
        raise UnreadableVideoError(message)
    return status.st_size


def _make_truncation_error(path: Path) -> TruncatedVideoError:
    message = f"{path} is truncated (its frame table is missing): copy or export it again"
    return TruncatedVideoError(message)


def _prepare_stream(container: InputContainer, path: Path) -> VideoStream:
    stream = find_video_stream(container)
    if stream is None:
        message = f"{path} contains no video"
        raise UnreadableVideoError(message)
    if not hasattr(stream, "width"):  # The attribute is missing if FFmpeg has no decoder.
        message = f"no decoder is available for the video in {path}: export it again as H.264"
        raise UnreadableVideoError(message)
    if not (stream.average_rate and stream.width and stream.height):
        message = (
            f"{path} does not state its frame rate or size, or has more than {MAX_PIXELS:,} "
            "pixels per frame: export it again as mp4"
        )
        raise UnreadableVideoError(message)
    try:
        require_picture_size(stream.width, stream.height)
    except ValueError as error:
        message = f"{path}: {error}"
        raise UnreadableVideoError(message) from error
    stream.thread_type = "AUTO"
    stream.codec_context.thread_count = _DECODER_THREADS
    stream.codec_context.options = _DECODER_LIMITS
    return stream


def _read_still(path: Path) -> bytes:
    if _require_regular_file(path) > _MAX_STILL_BYTES:
        message = f"{path} has more than {_MAX_STILL_BYTES:,} bytes: export it again"
        raise UnreadableVideoError(message)
    try:
        return path.read_bytes()
    except OSError as error:
        raise MissingFileError.of(path, error) from error


def _require_usable_still(path: Path, data: bytes, size: tuple[int, int] | None) -> StillHeader:
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
            f"{size[0]}x{size[1]}: resize the pictures, or scale the calibration"
        )
        raise UnreadableVideoError(message)
    if header.orientation != UPRIGHT:
        # COLMAP and nerfstudio calibrate pixels as stored, OpenCV calibrates pixels as displayed.
        # No file states whether its poses are for stored or displayed pixels, and a rotation by
        # 180 degrees does not change the picture size.
        message = (
            f"{path} has EXIF orientation {header.orientation}, which some tools apply and others "
            "ignore: remove the tag if the poses are for the pixels as stored (exiftool "
            "-Orientation= FILE), otherwise rotate the pixels (mogrify -auto-orient FILE)"
        )
        raise UnreadableVideoError(message)
    return header
