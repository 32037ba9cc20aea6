"""Faults of the container: HEAD, order and headers of chunks, the end, and single bytes."""

import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from hostile.mutations import damage_bytes
from hostile.structured.draws import Draws
from hostile.structured.hostility import Hostility, Stage
from hostile.structured.pieces import Piece
from quarc_ref.format import container, wire
from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import CHUNK_HEADER_BYTES, MAGIC
from quarc_ref.format.records import SeekPoint, Tail

_MAXIMUM = (1 << 32) - 1
_INTEGERS = (0, 1, 2, 7, 15, 25, 31, 32, 255, 257, (1 << 16) - 1, _MAXIMUM)
_FLOATS = (0.0, -1.0, 1e-45, 1024.5, 3e38, math.inf, math.nan)
_HEAD_FIELDS = "BBIIBIIBHHHBBffffBBHHHHQBBfB"
_CRITICAL = (b"SNAP", b"SnAP")
_ANCILLARY = (b"snap", b"nOte", b"fram")
_BAD_TYPES = (b"FR4M", b"FRam", b"\x00\xff  ", b"frAM", b"FRA\n")
_KINDS = (*_CRITICAL, *_ANCILLARY, *_BAD_TYPES, *container.KNOWN_TYPES)
Pieces = list[Piece]
_CAMERA = Camera("c", 64, 48, 5.0, 5.0, 32.0, 24.0, (1.0,) * 9, (0.0,) * 3, 0.5, held_out=False)
_LARGE = (
    (container.CAME, wire.build_cameras((_CAMERA, _CAMERA))),
    (container.META, wire.build_metadata({"capture": "drawn", "": ""})),
)


def _change_head(draws: Draws, pieces: Pieces) -> Pieces:
    """Write another number into a field of HEAD."""
    head, which = pieces[0].payload or b"", draws.rng.randrange(len(_HEAD_FIELDS))
    form = f"<{_HEAD_FIELDS[which]}"
    at, size = struct.calcsize(f"<{_HEAD_FIELDS[:which]}"), struct.calcsize(form)
    if form == "<f":
        field = struct.pack(form, draws.rng.choice(_FLOATS))
    else:
        field = struct.pack(form, draws.rng.choice(_INTEGERS) % (1 << 8 * size))
    return [replace(pieces[0], payload=head[:at] + field + head[at + size :]), *pieces[1:]]


def _other_version(draws: Draws, pieces: Pieces) -> Pieces:
    """Set another version, or require a feature."""
    head = bytearray(pieces[0].payload or b"")
    head[draws.rng.choice((0, 0, 1, 2, 5, 6))] = draws.rng.choice((0, 2, 128, 255))
    return [replace(pieces[0], payload=bytes(head)), *pieces[1:]]


def _resize_head(draws: Draws, pieces: Pieces) -> Pieces:
    head = pieces[0].payload or b""
    more = bytes(draws.rng.choice((1, 2000)))
    return [
        replace(pieces[0], payload=draws.rng.choice((head[:-1], b"", head + more))),
        *pieces[1:],
    ]


def _one(**lies: Callable[[Draws, Piece], Any]) -> Callable[[Draws, Pieces], Pieces]:
    """Return a function that makes one piece wrong."""

    def change(draws: Draws, pieces: Pieces) -> Pieces:
        place = draws.rng.randrange(len(pieces))
        said = {name: lie(draws, pieces[place]) for name, lie in lies.items()}
        return [*pieces[:place], replace(pieces[place], **said), *pieces[place + 1 :]]

    return change


def _swap(draws: Draws, pieces: Pieces) -> Pieces:
    changed = list(pieces)
    first, second = draws.rng.sample(range(len(pieces)), 2)
    changed[first], changed[second] = changed[second], changed[first]
    return changed


def _drop_chunk(draws: Draws, pieces: Pieces) -> Pieces:
    lost = draws.rng.randrange(len(pieces))
    return [*pieces[:lost], *pieces[lost + 1 :]]


def _repeat(draws: Draws, pieces: Pieces) -> Pieces:
    place = draws.rng.randrange(len(pieces))
    return [*pieces[:place], *[pieces[place]] * draws.rng.choice((2, 3)), *pieces[place + 1 :]]


def _insert_chunk(*kinds: bytes) -> Callable[[Draws, Pieces], Pieces]:
    """Return a function that inserts a chunk of one of these types."""

    def insert_chunk(draws: Draws, pieces: Pieces) -> Pieces:
        place = draws.rng.randrange(1, len(pieces))
        new = Piece(draws.rng.choice(kinds), draws.rng.randbytes(draws.rng.choice((0, 3, 40))))
        return [*pieces[:place], new, *pieces[place:]]

    return insert_chunk


def _splice(donors: Sequence[Pieces]) -> Callable[[Draws, Pieces], Pieces]:
    """Return a function that continues with another stream, or inserts one of its chunks."""

    def splice(draws: Draws, pieces: Pieces) -> Pieces:
        other, rng = draws.rng.choice(donors), draws.rng
        place, start = rng.randrange(1, len(pieces)), rng.randrange(len(other))
        if rng.random() < 0.5:
            return [*pieces[:place], *other[start:]]
        return [*pieces[:place], other[start], *pieces[place:]]

    return splice


def _damage_ancillary(draws: Draws, pieces: Pieces) -> Pieces:
    """Insert damaged cameras or metadata."""
    kind, payload = draws.rng.choice(_LARGE)
    damaged = damage_bytes(draws.rng, payload, payload)[0]
    place = draws.rng.randrange(1, len(pieces))
    return [*pieces[:place], Piece(kind, damaged), *pieces[place:]]


def _change_index(draws: Draws, pieces: Pieces) -> Pieces:
    """Write wrong seek points into INDX."""
    points = [SeekPoint(*draws.rng.choices((0, 1, 8, _MAXIMUM), k=3)) for _ in range(3)]
    index = wire.build_index(points[: draws.rng.randrange(4)])
    lie = Piece(container.INDX, draws.rng.choice((index, index, index, b"\xff" * 4)))
    *before, tail = (piece for piece in pieces if piece.kind != container.INDX)
    return [*before, lie, tail]


def _change_tail(draws: Draws, pieces: Pieces) -> Pieces:
    """Write wrong totals into TAIL."""
    tail = wire.build_tail(Tail(*draws.rng.choices((0, 1, 2, 8, _MAXIMUM), k=3)))
    lie = draws.rng.choice((tail, tail, tail, tail[:-1], tail + b"\0"))
    return [*pieces[:-1], replace(pieces[-1], payload=lie)]


def _cut(draws: Draws, data: bytes) -> bytes:
    return data[: draws.rng.randrange(len(data))]


def _extend(draws: Draws, data: bytes) -> bytes:
    return data + draws.rng.choice((b"\0", MAGIC, draws.rng.randbytes(30)))


def _change_magic(draws: Draws, data: bytes) -> bytes:
    at = draws.rng.randrange(len(MAGIC))
    return data[:at] + bytes([data[at] ^ 1 << draws.rng.randrange(8)]) + data[at + 1 :]


def _damage(draws: Draws, data: bytes) -> bytes:
    return damage_bytes(draws.rng, data, data)[0]


_LENGTHS = (0, 1, (1 << 22) + 1, (1 << 26) + 1, _MAXIMUM)


def list_hostile_streams(donors: Sequence[Pieces]) -> list[Hostility]:
    """Return the possible faults of a stream as a whole.

    Args:
        donors: Other streams.
    """
    pieces: dict[str, Callable[[Draws, Pieces], Pieces]] = {
        "a field of HEAD": _change_head,
        "another version": _other_version,
        "the size of HEAD": _resize_head,
        "sync": _one(sync=lambda draws, piece: draws.rng.choice((bytes(4), piece.sync[::-1]))),
        "the CRC of a header": _one(
            flipped_byte=lambda draws, _piece: draws.rng.randrange(8, CHUNK_HEADER_BYTES)
        ),
        "the CRC of a payload": _one(
            flipped_byte=lambda draws, _piece: -1 - draws.rng.randrange(4)
        ),
        "sequence": _one(sequence=lambda draws, _piece: draws.rng.choice((0, 1, 2, 3, _MAXIMUM))),
        "type": _one(kind=lambda draws, _piece: draws.rng.choice(_KINDS)),
        "length": _one(length=lambda draws, _piece: draws.rng.choice(_LENGTHS)),
        "chunks swapped": _swap,
        "a chunk lost": _drop_chunk,
        "a chunk repeated": _repeat,
        "an inserted chunk": _insert_chunk(*_KINDS),
        "an unknown chunk": _insert_chunk(*_ANCILLARY),
        "an unknown critical chunk": _insert_chunk(*_CRITICAL),
        "a chunk of a bad type": _insert_chunk(*_BAD_TYPES),
        "chunks of another stream": _splice(donors),
        "cameras and metadata": _damage_ancillary,
        "INDX": _change_index,
        "TAIL": _change_tail,
    }
    data: dict[str, Callable[[Draws, bytes], bytes]] = {
        "cut": _cut,
        "extended": _extend,
        "magic": _change_magic,
        "bytes": _damage,
    }
    return [
        *(Hostility(name, Stage.STREAM, pieces[name]) for name in pieces),
        *(Hostility(name, Stage.BYTES, data[name]) for name in data),
    ]
