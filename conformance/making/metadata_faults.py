"""invalid/: faults in the fields of `came` and `meta` (SPEC 5.6, 5.7)."""

import struct
from dataclasses import replace

from making.fault_rows import CAME, META
from making.payloads import pack_camera, pack_cameras
from making.vectors import Outcome, Valid, Vector, broken


def make_metadata_faults(parent: Valid) -> list[Vector]:
    """Faults that a decoder meets which makes use of `came` and `meta`."""
    good = pack_camera()
    at = {"held_out": 5, "width": 6, "fx": 14, "cx": 22, "translation": 66, "near": 78}

    def camera(field: str, value: bytes) -> bytes:
        place = at[field]
        return pack_cameras(good[:place] + value + good[place + len(value) :])

    nan, zero, inf = struct.pack("<f", float("nan")), bytes(4), struct.pack("<f", float("inf"))
    faults = {
        "camera-flag": (CAME, camera("held_out", b"\x02"), "field", "5-3", "held_out is 2"),
        "camera-width": (CAME, camera("width", zero), "field", "5-3", "width is 0"),
        "camera-focal-length": (CAME, camera("fx", zero), "field", "5-3", "fx is 0"),
        "camera-center": (CAME, camera("cx", nan), "field", "5-3", "cx is NaN"),
        "camera-translation": (
            CAME,
            camera("translation", inf),
            "field",
            "5-3",
            "a translation is infinite",
        ),
        "camera-near": (CAME, camera("near", zero), "field", "5-3", "near is 0"),
        "camera-name": (
            CAME,
            pack_cameras(pack_camera(b"\xc3\x28")),
            "field",
            "5-4",
            "a name that is not UTF-8",
        ),
        "camera-count": (
            CAME,
            b"\xff\xff" + pack_cameras(good)[2:],
            "field",
            "5-1",
            "65535 cameras are said, one is there",
        ),
        "camera-longer": (
            CAME,
            pack_cameras(good) + b"\0",
            "trailing-data",
            "5-2",
            "a byte after the last camera",
        ),
        "metadata-overlong": (
            META,
            _entry(b"title", b"\xc0\xaf"),
            "field",
            "5-4",
            "an overlong form in UTF-8",
        ),
        "metadata-surrogate": (
            META,
            _entry(b"title", b"\xed\xa0\x80"),
            "field",
            "5-4",
            "a surrogate in UTF-8",
        ),
        "metadata-key": (META, _entry(b"\xff", b""), "field", "5-4", "a key that is not UTF-8"),
        "metadata-length": (
            META,
            _entry(b"title", b"abc")[:-1],
            "field",
            "5-1",
            "a value that passes the end of the payload",
        ),
        "metadata-greatest-length": (
            META,
            b"\1\0\1t\xff\xff\xff\xff",
            "field",
            "5-1 13-1",
            "a value of 2^32 - 1 bytes",
        ),
        "metadata-longer": (
            META,
            _entry(b"title", b"abc") + b"\0",
            "trailing-data",
            "5-2",
            "a byte after the last entry",
        ),
    }
    vectors = []
    for name, (place, payload, ids, clauses, note) in faults.items():
        pieces = parent.stream.replaced(place, payload=payload)
        outcome = Outcome(parent.frames[:4] if place == META else (), (ids,))
        vector = broken(parent, f"invalid/{name}", clauses, pieces, outcome, note)
        vectors.append(replace(vector, needs="metadata"))
    return vectors


def _entry(key: bytes, value: bytes) -> bytes:
    return struct.pack("<HB", 1, len(key)) + key + struct.pack("<I", len(value)) + value
