"""Decodes picture files, which the module `media` opens.

Picture files with 16 bits per channel are rounded to 8 bits, because FFmpeg's scaler would dither
them and make them brighter.
"""

from pathlib import Path

import av
import numpy as np

from quarc_ref.datasets.capture import Alpha, Image
from quarc_ref.datasets.errors import UnreadableVideoError
from quarc_ref.datasets.media import decode_still
from quarc_ref.datasets.orientation import MAX_LEVEL_BITS

_FULL_CHROMA = {"yuvj420p": "yuvj444p", "yuvj422p": "yuvj444p", "yuvj440p": "yuvj444p"}  # JPEG
_PALETTE_FORMAT = "pal8"
_ALPHA_FORMATS = ("rgba", "rgba64be", "ya8", "ya16be", _PALETTE_FORMAT)  # PNG
_OPAQUE = 255
_DEEP_LEVELS_PER_LEVEL = 65535 // 255  # levels of 16 bits per level of 8 bits


def read_still(path: Path, size: tuple[int, int] | None = None) -> Image:
    """Read a PNG or JPEG file as `[H, W, 3]` sRGB; transparency is ignored.

    The levels of 16-bit PNG files are rounded to 8 bits. The chroma of JPEG files is upsampled
    before the conversion to RGB, because FFmpeg converts subsampled chroma with truncated levels,
    up to 2 darker than those of libjpeg.

    Args:
        path: Path of the file.
        size: Width and height that the picture must have, pixels; None for any.

    Raises:
        MissingFileError: The file does not exist.
        UnreadableVideoError: The file is not a picture, has an EXIF orientation, or has a
            different size.
    """
    frame = decode_still(path, size)
    try:
        if frame.format.components[0].bits > MAX_LEVEL_BITS:
            levels = frame.to_ndarray(format="rgb48le") / _DEEP_LEVELS_PER_LEVEL
            return np.asarray(np.rint(levels), dtype=np.uint8)
        height, width = frame.height, frame.width
        if frame.format.name in _FULL_CHROMA:
            frame = _pad_to_even_size(frame).reformat(format=_FULL_CHROMA[frame.format.name])
        picture = frame.to_ndarray(format="rgb24")[:height, :width]
        return np.ascontiguousarray(picture, dtype=np.uint8)
    except (av.FFmpegError, ValueError) as error:
        message = f"{path} cannot be converted to RGB ({error}): export it again"
        raise UnreadableVideoError(message) from error


def read_still_alpha(path: Path) -> Alpha | None:
    """Read the alpha channel `[H, W]` of a PNG file; return None if the file has none.

    Alpha with 16 bits is rounded to 8 bits.

    Raises:
        MissingFileError: The file does not exist.
        UnreadableVideoError: The file is not a picture, or has an EXIF orientation.
    """
    frame = decode_still(path)
    if frame.format.name not in _ALPHA_FORMATS:
        return None
    if frame.format.components[0].bits > MAX_LEVEL_BITS:
        levels = frame.to_ndarray(format="rgba64le")[..., 3] / _DEEP_LEVELS_PER_LEVEL
        return np.asarray(np.rint(levels), dtype=np.uint8)
    alpha = np.ascontiguousarray(frame.to_ndarray(format="rgba")[..., 3], dtype=np.uint8)
    is_opaque_palette = frame.format.name == _PALETTE_FORMAT and alpha.min() == _OPAQUE
    return None if is_opaque_palette else alpha


def _pad_to_even_size(frame: av.VideoFrame) -> av.VideoFrame:
    """Return a frame whose chroma has exactly half its size, by repeating the last pixels.

    FFmpeg would scale the chroma of an odd size by less than two, and so shift the colors.
    """
    width, height = frame.width + frame.width % 2, frame.height + frame.height % 2
    if (width, height) == (frame.width, frame.height):
        return frame
    padded = av.VideoFrame(width, height, frame.format.name)
    padded.colorspace, padded.color_range = frame.colorspace, frame.color_range
    for plane, padded_plane in zip(frame.planes, padded.planes, strict=True):
        stored_rows = np.frombuffer(memoryview(plane), np.uint8).reshape(plane.height, -1)
        rows = stored_rows[:, : plane.width]
        size = (padded_plane.height, padded_plane.line_size)
        padding = [(0, new - old) for new, old in zip(size, rows.shape, strict=True)]
        padded_plane.update(np.pad(rows, padding, mode="edge").tobytes())
    return padded
