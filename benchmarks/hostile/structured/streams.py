"""Faults of the container: HEAD, chunk headers, order of chunks, INDX, TAIL and damaged bytes."""

import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from hostile.mutations import damage_bytes
from hostile.structured.fault import Fault, Stage
from hostile.structured.generator import RecordGenerator
from hostile.structured.pieces import Piece
from quarc_ref.format import container, wire
from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import CHUNK_HEADER_BYTES, MAGIC
from quarc_ref.format.records import SeekPoint, Tail

_MAX_U32 = (1 << 32) - 1
_FIELD_INTEGERS = (0, 1, 2, 7, 15, 25, 31, 32, 255, 257, (1 << 16) - 1, _MAX_U32)
_FIELD_FLOATS = (0.0, -1.0, 1e-45, 1024.5, 3e38, math.inf, math.nan)
_HEAD_FORMATS = "BBIIBIIBHHHBBffffBBHHHHQBBfB"
_VERSION_BYTES = 7  # versions and features at the start of HEAD
_CRITICAL_TYPES = (b"SNAP", b"SnAP")
_ANCILLARY_TYPES = (b"snap", b"nOte", b"fram")
_BAD_TYPES = (b"FR4M", b"FRam", b"\x00\xff  ", b"frAM", b"FRA\n")
_CHUNK_TYPES = (*_CRITICAL_TYPES, *_ANCILLARY_TYPES, *_BAD_TYPES, *container.KNOWN_TYPES)
Pieces = list[Piece]
_CAMERA = Camera("c", 64, 48, 5.0, 5.0, 32.0, 24.0, (1.0,) * 9, (0.0,) * 3, 0.5, held_out=False)
_ANCILLARY_PAYLOADS = (
    (container.CAME, wire.build_cameras((_CAMERA, _CAMERA))),
    (container.META, wire.build_metadata({"capture": "drawn", "": ""})),
)


def _change_head(generator: RecordGenerator, pieces: Pieces) -> Pieces:
    """Write an unusual number into a field of HEAD."""
    head, field_number = pieces[0].payload or b"", generator.rng.randrange(len(_HEAD_FORMATS))
    field_format = f"<{_HEAD_FORMATS[field_number]}"
    offset, size = (
        struct.calcsize(f"<{_HEAD_FORMATS[:field_number]}"),
        struct.calcsize(field_format),
    )
    if field_format == "<f":
        field = struct.pack(field_format, generator.rng.choice(_FIELD_FLOATS))
    else:
        field = struct.pack(field_format, generator.rng.choice(_FIELD_INTEGERS) % (1 << 8 * size))
    return [replace(pieces[0], payload=head[:offset] + field + head[offset + size :]), *pieces[1:]]


def _change_version(generator: RecordGenerator, pieces: Pieces) -> Pieces:
    """Write a different format version, or require a feature that the stream does not need."""
    # Another fault may have emptied the payload.
    head = bytearray((pieces[0].payload or b"").ljust(_VERSION_BYTES, b"\0"))
    head[generator.rng.choice((0, 0, 1, 2, 5, 6))] = generator.rng.choice((0, 2, 128, 255))
    return [replace(pieces[0], payload=bytes(head)), *pieces[1:]]


def _resize_head(generator: RecordGenerator, pieces: Pieces) -> Pieces:
    head = pieces[0].payload or b""
    extra = bytes(generator.rng.choice((1, 2000)))
    return [
        replace(pieces[0], payload=generator.rng.choice((head[:-1], b"", head + extra))),
        *pieces[1:],
    ]


def _make_piece_change(
    **choose_by_field: Callable[[RecordGenerator, Piece], Any],
) -> Callable[[RecordGenerator, Pieces], Pieces]:
    """Return a function that sets fields of a random piece; the arguments choose the values."""

    def change(generator: RecordGenerator, pieces: Pieces) -> Pieces:
        index = generator.rng.randrange(len(pieces))
        values = {
            name: choose_value(generator, pieces[index])
            for name, choose_value in choose_by_field.items()
        }
        return [*pieces[:index], replace(pieces[index], **values), *pieces[index + 1 :]]

    return change


def _swap_chunks(generator: RecordGenerator, pieces: Pieces) -> Pieces:
    changed = list(pieces)
    first, second = generator.rng.sample(range(len(pieces)), 2)
    changed[first], changed[second] = changed[second], changed[first]
    return changed


def _drop_chunk(generator: RecordGenerator, pieces: Pieces) -> Pieces:
    index = generator.rng.randrange(len(pieces))
    return [*pieces[:index], *pieces[index + 1 :]]


def _repeat_chunk(generator: RecordGenerator, pieces: Pieces) -> Pieces:
    index = generator.rng.randrange(len(pieces))
    return [*pieces[:index], *[pieces[index]] * generator.rng.choice((2, 3)), *pieces[index + 1 :]]


def _make_insertion(*kinds: bytes) -> Callable[[RecordGenerator, Pieces], Pieces]:
    """Return a function that inserts a chunk of one of the types."""

    def insert_chunk(generator: RecordGenerator, pieces: Pieces) -> Pieces:
        index = generator.rng.randrange(1, len(pieces))
        chunk = Piece(
            generator.rng.choice(kinds), generator.rng.randbytes(generator.rng.choice((0, 3, 40)))
        )
        return [*pieces[:index], chunk, *pieces[index:]]

    return insert_chunk


def _make_splice(donors: Sequence[Pieces]) -> Callable[[RecordGenerator, Pieces], Pieces]:
    """Return a function that inserts a chunk of another stream, or continues with that stream."""

    def splice(generator: RecordGenerator, pieces: Pieces) -> Pieces:
        donor, rng = generator.rng.choice(donors), generator.rng
        index, start = rng.randrange(1, len(pieces)), rng.randrange(len(donor))
        if rng.random() < 0.5:
            return [*pieces[:index], *donor[start:]]
        return [*pieces[:index], donor[start], *pieces[index:]]

    return splice


def _insert_damaged_ancillary(generator: RecordGenerator, pieces: Pieces) -> Pieces:
    """Insert damaged cameras or metadata."""
    kind, payload = generator.rng.choice(_ANCILLARY_PAYLOADS)
    damaged = damage_bytes(generator.rng, payload, payload)[0]
    index = generator.rng.randrange(1, len(pieces))
    return [*pieces[:index], Piece(kind, damaged), *pieces[index:]]


def _change_index(generator: RecordGenerator, pieces: Pieces) -> Pieces:
    """Write wrong seek points into INDX."""
    seek_points = [SeekPoint(*generator.rng.choices((0, 1, 8, _MAX_U32), k=3)) for _ in range(3)]
    index = wire.build_index(seek_points[: generator.rng.randrange(4)])
    wrong_index = Piece(container.INDX, generator.rng.choice((index, index, index, b"\xff" * 4)))
    *other_pieces, tail = (piece for piece in pieces if piece.kind != container.INDX)
    return [*other_pieces, wrong_index, tail]


def _change_tail(generator: RecordGenerator, pieces: Pieces) -> Pieces:
    """Write wrong totals into TAIL."""
    tail = wire.build_tail(Tail(*generator.rng.choices((0, 1, 2, 8, _MAX_U32), k=3)))
    wrong_tail = generator.rng.choice((tail, tail, tail, tail[:-1], tail + b"\0"))
    return [*pieces[:-1], replace(pieces[-1], payload=wrong_tail)]


def _truncate(generator: RecordGenerator, data: bytes) -> bytes:
    return data[: generator.rng.randrange(len(data))]


def _extend(generator: RecordGenerator, data: bytes) -> bytes:
    return data + generator.rng.choice((b"\0", MAGIC, generator.rng.randbytes(30)))


def _change_magic(generator: RecordGenerator, data: bytes) -> bytes:
    index = generator.rng.randrange(len(MAGIC))
    return data[:index] + bytes([data[index] ^ 1 << generator.rng.randrange(8)]) + data[index + 1 :]


def _damage(generator: RecordGenerator, data: bytes) -> bytes:
    return damage_bytes(generator.rng, data, data)[0]


_CHUNK_LENGTHS = (0, 1, (1 << 22) + 1, (1 << 26) + 1, _MAX_U32)


def list_container_faults(donors: Sequence[Pieces]) -> list[Fault]:
    """Return the possible faults of a stream's chunks and bytes.

    Args:
        donors: Pieces of other streams.
    """
    stream_changes: dict[str, Callable[[RecordGenerator, Pieces], Pieces]] = {
        "an unusual value in HEAD": _change_head,
        "a different version": _change_version,
        "a wrong size of HEAD": _resize_head,
        "a wrong sync word": _make_piece_change(
            sync=lambda generator, piece: generator.rng.choice((bytes(4), piece.sync[::-1]))
        ),
        "a flipped bit in a chunk header": _make_piece_change(
            flipped_byte=lambda generator, _piece: generator.rng.randrange(8, CHUNK_HEADER_BYTES)
        ),
        "a flipped bit in a payload CRC": _make_piece_change(
            flipped_byte=lambda generator, _piece: -1 - generator.rng.randrange(4)
        ),
        "a wrong sequence number": _make_piece_change(
            sequence=lambda generator, _piece: generator.rng.choice((0, 1, 2, 3, _MAX_U32))
        ),
        "a wrong chunk type": _make_piece_change(
            kind=lambda generator, _piece: generator.rng.choice(_CHUNK_TYPES)
        ),
        "a wrong chunk length": _make_piece_change(
            length=lambda generator, _piece: generator.rng.choice(_CHUNK_LENGTHS)
        ),
        "two swapped chunks": _swap_chunks,
        "a missing chunk": _drop_chunk,
        "a repeated chunk": _repeat_chunk,
        "an inserted chunk": _make_insertion(*_CHUNK_TYPES),
        "an unknown ancillary chunk": _make_insertion(*_ANCILLARY_TYPES),
        "an unknown critical chunk": _make_insertion(*_CRITICAL_TYPES),
        "a chunk with an invalid type": _make_insertion(*_BAD_TYPES),
        "chunks of another stream": _make_splice(donors),
        "damaged cameras or metadata": _insert_damaged_ancillary,
        "wrong seek points in INDX": _change_index,
        "wrong totals in TAIL": _change_tail,
    }
    byte_changes: dict[str, Callable[[RecordGenerator, bytes], bytes]] = {
        "a truncated stream": _truncate,
        "extra bytes at the end": _extend,
        "a flipped bit in the magic": _change_magic,
        "damaged bytes": _damage,
    }
    return [
        *(Fault(name, Stage.STREAM, stream_changes[name]) for name in stream_changes),
        *(Fault(name, Stage.BYTES, byte_changes[name]) for name in byte_changes),
    ]
