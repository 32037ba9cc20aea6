"""Makes vectors in invalid/: faults in the fields of `came` and `meta` (SPEC 5.6, 5.7)."""

import struct
from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import CAME_CHUNK_INDEX, META_CHUNK_INDEX
from making.payloads import pack_camera, pack_cameras
from making.vectors import Outcome, ValidStream, Vector, make_patched_vector

_NAN, _INFINITY, _MINUS_ONE = (struct.pack("<f", float(word)) for word in ("nan", "inf", "-1"))
_ZERO_U32, _MAX_U32 = bytes(4), b"\xff\xff\xff\xff"
_CAMERA_FIELDS = {
    "camera-flag": (5, b"\2", "held_out is 2"),
    "camera-width": (6, _ZERO_U32, "width is 0"),
    "camera-focal-length": (14, _ZERO_U32, "fx is 0"),
    "camera-center": (22, _NAN, "cx is NaN"),
    "camera-translation": (66, _INFINITY, "a translation is infinite"),
    "camera-near": (78, _ZERO_U32, "near is 0"),
    "camera-height": (10, _ZERO_U32, "height is 0"),
    "camera-negative-focal-length": (14, _MINUS_ONE, "fx is negative"),
    "camera-infinite-focal-length": (14, _INFINITY, "fx is infinite"),
    "camera-focal-length-y": (18, _ZERO_U32, "fy is 0"),
    "camera-center-y": (26, _INFINITY, "cy is infinite"),
    "camera-rotation": (30, _NAN, "the first element of the rotation is NaN"),
    "camera-rotation-end": (62, _NAN, "the last element of the rotation is NaN"),
    "camera-negative-near": (78, _MINUS_ONE, "near is negative"),
    "camera-infinite-focal-length-y": (18, _INFINITY, "fy is infinite"),
    "camera-infinite-near": (78, _INFINITY, "near is infinite"),
    "camera-translation-end": (74, _NAN, "the last element of the translation is NaN"),
}
"""Offset of a field in a camera with a name of four bytes, its wrong value, and a description."""
MetadataFault = tuple[str, bytes, str, str, str]
"""Name, payload, reject id, clauses and description."""


def make_metadata_faults(parent: ValidStream) -> list[Vector]:
    """Return vectors with faults in `came` or `meta`, for decoders that parse these chunks."""
    return [
        *_make_faults_at(parent, CAME_CHUNK_INDEX, 0, _list_camera_faults()),
        *_make_faults_at(parent, META_CHUNK_INDEX, 4, _list_entry_faults()),
    ]


def _make_faults_at(
    parent: ValidStream, chunk_index: int, frame_count: int, faults: Iterable[MetadataFault]
) -> Iterable[Vector]:
    for name, payload, reject_id, clauses, note in faults:
        chunks = parent.stream.replace_chunk(chunk_index, payload=payload)
        outcome = Outcome(parent.frames[:frame_count], (reject_id,))
        vector = make_patched_vector(parent, f"invalid/{name}", clauses, chunks, outcome, note)
        yield replace(vector, needs="metadata")


def _list_camera_faults() -> Iterable[MetadataFault]:
    valid_camera = pack_camera()
    for name, (offset, value, note) in _CAMERA_FIELDS.items():
        camera = valid_camera[:offset] + value + valid_camera[offset + len(value) :]
        yield name, pack_cameras(camera), "field", "5-3", note
    with_bad_name, cameras = pack_cameras(pack_camera(b"\xc3\x28")), pack_cameras(valid_camera)
    with_wrong_count = b"\xff\xff" + cameras[2:]
    yield "camera-name", with_bad_name, "field", "5-4", "a name that is not UTF-8"
    yield (
        "camera-count",
        with_wrong_count,
        "field",
        "5-1",
        "`came` states 65535 cameras but contains one",
    )
    yield "camera-longer", cameras + b"\0", "trailing-data", "5-2", "a byte after the last camera"


_WRONG_TEXTS = {
    "overlong": (b"\xc0\xaf", "an overlong UTF-8 sequence"),
    "surrogate": (b"\xed\xa0\x80", "a surrogate encoded in UTF-8"),
    "overlong-3": (b"\xe0\x9f\xbf", "an overlong UTF-8 sequence of three bytes"),
    "overlong-4": (b"\xf0\x8f\xbf\xbf", "an overlong UTF-8 sequence of four bytes"),
    "beyond-unicode": (b"\xf4\x90\x80\x80", "U+110000, which is beyond Unicode"),
    "cut-character": ("café".encode()[:-1], "a value that ends within a character"),
    "continuation": (b"\xa9", "a continuation byte without a leading byte"),
}


def _list_entry_faults() -> Iterable[MetadataFault]:
    valid_entry, with_bad_key = _pack_entry(b"title", b"abc"), _pack_entry(b"\xff", b"")
    huge_entry, note = b"\1\0\1t" + _MAX_U32, "a value that extends beyond the payload"
    for name, (value, value_note) in _WRONG_TEXTS.items():
        yield f"metadata-{name}", _pack_entry(b"title", value), "field", "5-4", value_note
    yield "metadata-key", with_bad_key, "field", "5-4", "a key that is not UTF-8"
    yield "metadata-length", valid_entry[:-1], "field", "5-1", note
    yield (
        "metadata-greatest-length",
        huge_entry,
        "field",
        "5-1 13-1",
        "the stated length of a value is 2^32 - 1 bytes",
    )
    yield (
        "metadata-longer",
        valid_entry + b"\0",
        "trailing-data",
        "5-2",
        "a byte after the last entry",
    )


def _pack_entry(key: bytes, value: bytes) -> bytes:
    return struct.pack("<HB", 1, len(key)) + key + struct.pack("<I", len(value)) + value
