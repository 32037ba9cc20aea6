"""invalid/: faults in the fields of `came` and `meta` (SPEC 5.6, 5.7)."""

import struct
from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import CAME, META
from making.payloads import pack_camera, pack_cameras
from making.vectors import Outcome, Valid, Vector, broken

_NAN, _INFINITE = (struct.pack("<f", float(word)) for word in ("nan", "inf"))
_ZERO, _MAXIMUM = bytes(4), b"\xff\xff\xff\xff"
_CAMERA_FIELDS = {
    "camera-flag": (5, b"\2", "held_out is 2"),
    "camera-width": (6, _ZERO, "width is 0"),
    "camera-focal-length": (14, _ZERO, "fx is 0"),
    "camera-center": (22, _NAN, "cx is NaN"),
    "camera-translation": (66, _INFINITE, "a translation is infinite"),
    "camera-near": (78, _ZERO, "near is 0"),
}
"""Offset of a field in a camera whose name has four bytes, and its value."""
Fault = tuple[str, bytes, str, str, str]
"""Name, payload, reject id, clauses and description."""


def make_metadata_faults(parent: Valid) -> list[Vector]:
    """Return faults for decoders that use `came` and `meta`."""
    return [
        *_found_at(parent, CAME, 0, _of_cameras()),
        *_found_at(parent, META, 4, _of_entries()),
    ]


def _found_at(parent: Valid, place: int, frames: int, faults: Iterable[Fault]) -> Iterable[Vector]:
    for name, payload, ids, clauses, note in faults:
        pieces = parent.stream.replaced(place, payload=payload)
        outcome = Outcome(parent.frames[:frames], (ids,))
        vector = broken(parent, f"invalid/{name}", clauses, pieces, outcome, note)
        yield replace(vector, needs="metadata")


def _of_cameras() -> Iterable[Fault]:
    good = pack_camera()
    for name, (place, value, note) in _CAMERA_FIELDS.items():
        camera = good[:place] + value + good[place + len(value) :]
        yield name, pack_cameras(camera), "field", "5-3", note
    named, all_there = pack_cameras(pack_camera(b"\xc3\x28")), pack_cameras(good)
    many = b"\xff\xff" + all_there[2:]
    yield "camera-name", named, "field", "5-4", "a name that is not UTF-8"
    yield "camera-count", many, "field", "5-1", "65535 cameras are stated, one exists"
    yield "camera-longer", all_there + b"\0", "trailing-data", "5-2", "a byte after the last camera"


def _of_entries() -> Iterable[Fault]:
    overlong, surrogate = _entry(b"title", b"\xc0\xaf"), _entry(b"title", b"\xed\xa0\x80")
    good, key = _entry(b"title", b"abc"), _entry(b"\xff", b"")
    endless, past = b"\1\0\1t" + _MAXIMUM, "a value that extends beyond the payload"
    yield "metadata-overlong", overlong, "field", "5-4", "an overlong form in UTF-8"
    yield "metadata-surrogate", surrogate, "field", "5-4", "a surrogate in UTF-8"
    yield "metadata-key", key, "field", "5-4", "a key that is not UTF-8"
    yield "metadata-length", good[:-1], "field", "5-1", past
    yield "metadata-greatest-length", endless, "field", "5-1 13-1", "a value of 2^32 - 1 bytes"
    yield "metadata-longer", good + b"\0", "trailing-data", "5-2", "a byte after the last entry"


def _entry(key: bytes, value: bytes) -> bytes:
    return struct.pack("<HB", 1, len(key)) + key + struct.pack("<I", len(value)) + value
