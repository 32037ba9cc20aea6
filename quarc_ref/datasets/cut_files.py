"""Recognizes videos that were cut off, such as by an interrupted copy, from their structure.

An mp4 file consists of boxes: a size, a type and data (ISO/IEC 14496-12). An mkv or webm file
consists of elements: an id, a size and data (RFC 8794). A complete recording is in one element.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

_MAX_BOXES = 100_000  # an hour of recording in fragments has some thousands
_MIN_BOX_BYTES, _BOX_HEADER_BYTES = 8, 16  # the header is longer if the size has 64 bits
_MAX_ELEMENTS = 10  # before the recording
_ELEMENT_HEADER_BYTES = 12
_EBML, _SEGMENT = b"\x1a\x45\xdf\xa3", b"\x18\x53\x80\x67"


def lacks_frame_table(path: Path) -> bool:
    """Return whether an mp4 file has no complete frame table, which cameras write at the end."""
    with path.open("rb") as file:
        data_size, kinds = _find_size(file), set()
        for kind, end in _list_boxes(file, data_size):
            kinds.add(kind)
            if kind == b"moov" and end <= data_size:
                return False
    return b"ftyp" in kinds


def is_cut_off(path: Path) -> bool:
    """Return whether an mkv, webm or fragmented mp4 file ends before the end that it states.

    Other mp4 files state their number of frames.
    """
    with path.open("rb") as file:
        data_size = _find_size(file)
        if file.read(len(_EBML)) == _EBML:
            return _find_segment_end(file, data_size) > data_size
        kinds = set()
        for kind, end in _list_boxes(file, data_size):
            kinds.add(kind)
            if kind in (b"moof", b"mdat") and end > data_size:
                return b"moof" in kinds
    return False


def _list_boxes(file: BinaryIO, data_size: int) -> Iterator[tuple[bytes, int]]:
    """Yield the types and ends of the boxes of an mp4 file up to the first that has no end."""
    position = 0
    for _ in range(_MAX_BOXES):
        file.seek(position)
        header = file.read(_BOX_HEADER_BYTES)
        size = int.from_bytes(header[:4])
        if size == 1:  # the size has 64 bits
            size = int.from_bytes(header[8:])
        position += size
        yield header[4:8], position
        if size < _MIN_BOX_BYTES or position >= data_size:
            return


def _find_segment_end(file: BinaryIO, data_size: int) -> int:
    """Return the end of the recording in an mkv or webm file; 0 if the file does not state it."""
    position = 0
    for _ in range(_MAX_ELEMENTS):
        if position >= data_size:  # Systems reject very large positions.
            break
        file.seek(position)
        header = file.read(_ELEMENT_HEADER_BYTES)
        id_size = _find_number_size(header)
        number_size = _find_number_size(header[id_size:])
        if not (id_size and number_size):
            return 0
        number = int.from_bytes(header[id_size : id_size + number_size])
        size = number & ((1 << 7 * number_size) - 1)  # without the bit that tells its length
        if size == (1 << 7 * number_size) - 1:  # The size is unknown, as in live recordings.
            return 0
        position += id_size + number_size + size
        if header[:id_size] == _SEGMENT:
            return position
    return 0


def _find_number_size(data: bytes) -> int:
    """Return the number of bytes of an EBML number, which its first byte tells; 0 if invalid."""
    return 9 - data[0].bit_length() if data and data[0] else 0


def _find_size(file: BinaryIO) -> int:
    size = file.seek(0, 2)
    file.seek(0)
    return size
