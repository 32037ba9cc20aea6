"""Reads the size and orientation of a PNG or JPEG picture without decoding the picture."""

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Literal, NamedTuple

UPRIGHT = 1  # EXIF orientation of an upright picture.
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_JPEG_SIGNATURE = b"\xff\xd8\xff"
_EXIF_PREFIX = b"Exif\0\0"
_MARKER_PATTERN = re.compile(rb"\xff([^\x00\xff])", re.DOTALL)
_APP1_MARKER, _SCAN_MARKER = 0xE1, 0xDA
_BARE_MARKERS = {0x01, *range(0xD0, 0xDA)}  # Markers without a length field.
_FRAME_MARKERS = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}
_ORIENTATION_TAG, _SHORT_TYPE = 0x0112, 3
# Maximum number of chunks or segments before the picture data; real files have dozens.
_MAX_HEADER_PARTS = 4096


@dataclass(frozen=True, slots=True)
class StillHeader:
    """The header of a picture file.

    Attributes:
        codec: Name of FFmpeg's decoder for the file.
        width: Width of the stored picture, pixels.
        height: Height of the stored picture, pixels.
        orientation: EXIF orientation, 1 to 8; `UPRIGHT` if the file has none.
    """

    codec: Literal["png", "mjpeg"]
    width: int
    height: int
    orientation: int


class _HeaderPart(NamedTuple):
    """A chunk of a PNG file, or a segment of a JPEG file."""

    kind: bytes | int
    payload: bytes


def read_still_header(data: bytes) -> StillHeader:
    """Read the header of a picture file.

    Args:
        data: The whole file.

    Raises:
        ValueError: The file is neither PNG nor JPEG, or its header is malformed.
    """
    try:
        if data.startswith(_PNG_SIGNATURE):
            return _read_png(list(islice(_split_png(data), _MAX_HEADER_PARTS)))
        if data.startswith(_JPEG_SIGNATURE):
            return _read_jpeg(list(islice(_split_jpeg(data), _MAX_HEADER_PARTS)))
    except (IndexError, struct.error) as error:
        message = "the header is truncated"
        raise ValueError(message) from error
    message = "the file is neither PNG nor JPEG"
    raise ValueError(message)


def _split_png(data: bytes) -> Iterator[_HeaderPart]:
    """Yield the PNG chunks before the picture data."""
    position = len(_PNG_SIGNATURE)
    while True:
        length, kind = struct.unpack_from(">I4s", data, position)
        if kind == b"IDAT":
            return
        yield _HeaderPart(kind, data[position + 8 : position + 8 + length])
        position += 12 + length


def _read_png(chunks: list[_HeaderPart]) -> StillHeader:
    if not chunks or chunks[0].kind != b"IHDR":
        message = "the first chunk is not a PNG header"
        raise ValueError(message)
    width, height = struct.unpack_from(">II", chunks[0].payload)
    exif_blocks = [chunk.payload for chunk in chunks if chunk.kind == b"eXIf"]
    return StillHeader("png", width, height, _find_orientation(exif_blocks))


def _split_jpeg(data: bytes) -> Iterator[_HeaderPart]:
    """Yield the JPEG segments before the picture data; bytes between segments are skipped."""
    position = 2
    while (match := _MARKER_PATTERN.search(data, position)) is not None:
        marker, position = match[1][0], match.end()
        if marker == _SCAN_MARKER:
            return
        length = 0
        if marker not in _BARE_MARKERS:
            (length,) = struct.unpack_from(">H", data, position)
        yield _HeaderPart(marker, data[position + 2 : position + length])
        position += length


def _read_jpeg(segments: list[_HeaderPart]) -> StillHeader:
    frame_header = next((s.payload for s in segments if s.kind in _FRAME_MARKERS), None)
    if frame_header is None:
        message = "the file has no JPEG frame header"
        raise ValueError(message)
    height, width = struct.unpack_from(">HH", frame_header, 1)
    exif_blocks = [
        segment.payload.removeprefix(_EXIF_PREFIX)
        for segment in segments
        if segment.kind == _APP1_MARKER and segment.payload.startswith(_EXIF_PREFIX)
    ]
    return StillHeader("mjpeg", width, height, _find_orientation(exif_blocks))


def _find_orientation(exif_blocks: list[bytes]) -> int:
    """Return the orientation in the first EXIF block; `UPRIGHT` if there is no valid block."""
    try:
        orientation = _read_orientation(exif_blocks[0])
    except (IndexError, KeyError, struct.error):
        return UPRIGHT
    return orientation if 1 <= orientation <= 8 else UPRIGHT


def _read_orientation(exif_block: bytes) -> int:
    """Read the orientation from the first directory of an EXIF block, which is in TIFF format."""
    byte_order = {b"II*\0": "<", b"MM\0*": ">"}[exif_block[:4]]
    (directory_offset,) = struct.unpack_from(f"{byte_order}I", exif_block, 4)
    (count,) = struct.unpack_from(f"{byte_order}H", exif_block, directory_offset)
    for index in range(count):
        tag, kind, _, value = struct.unpack_from(
            f"{byte_order}HHIH", exif_block, directory_offset + 2 + 12 * index
        )
        if (tag, kind) == (_ORIENTATION_TAG, _SHORT_TYPE):
            return int(value)
    return UPRIGHT
