"""Streams of frames: numbered, with CRCs, and with the correct index and totals.

A stream is a list of pieces. A piece can be left unchanged, replaced, or made wrong in one respect;
INDX and TAIL are generated last from the pieces.
"""

import struct
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

from making.changes import Change, Coded, Survivor, state_nothing
from making.frames import make_canonical, make_frame, make_snapshot
from making.payloads import (
    MAGIC,
    Canonical,
    Frame,
    Head,
    Snapshot,
    pack_chunk_header,
    pack_index,
    pack_tail,
)
from making.writing import State
from plain.state import PlainState

FRAMES = (b"CANO", b"SNAP", b"FRAM")


@dataclass(frozen=True)
class Decoded:
    """The expected output for a frame: its ordinal, number of Gaussians and digest."""

    frame: int
    gaussians: int
    sha256: str


@dataclass(frozen=True)
class Piece:
    """A chunk to write.

    Attributes:
        kind: Its type.
        payload: None for INDX and TAIL, whose payloads are computed from the stream; bytes
            override them.
        sequence: Sequence number that replaces the correct one.
        flip_byte: Index of a byte whose lowest bit is flipped after the CRCs are computed.
        skip: How many sequence numbers the chunk skips before its own.
    """

    kind: bytes
    payload: bytes | None
    sequence: int | None = None
    flip_byte: int | None = None
    skip: int = 0

    def pack(self, number: int, payload: bytes) -> bytes:
        """Return the chunk."""
        sequence = number if self.sequence is None else self.sequence
        header = pack_chunk_header(self.kind, sequence, len(payload))
        data = header + payload + struct.pack("<I", zlib.crc32(payload))
        if self.flip_byte is None:
            return data
        spoiled = bytearray(data)
        spoiled[self.flip_byte] ^= 1
        return bytes(spoiled)


@dataclass(frozen=True)
class Layout:
    """A stream and the offsets of its chunks.

    Attributes:
        data: The stream.
        offsets: Offsets of every chunk, and of the end.
    """

    data: bytes
    offsets: tuple[int, ...]


def assemble(pieces: Iterable[Piece]) -> Layout:
    """Number the chunks and add their CRCs; generate INDX and TAIL."""
    data, offsets, points, number = MAGIC, [], [], 0
    frames, index_offset, kinds = 0, 0, (b"CANO", b"FRAM")
    for piece in pieces:
        if piece.kind == b"HEAD" and (piece.payload or bytes(3))[2] & 4:
            kinds = FRAMES
        offsets.append(len(data))
        number += piece.skip
        payload = piece.payload
        if piece.kind == b"INDX":
            index_offset = index_offset or len(data)
            payload = pack_index(points) if payload is None else payload
        elif piece.kind == b"TAIL" and payload is None:
            payload = pack_tail(frames, len(points), index_offset)
        elif piece.kind in kinds and piece.kind != b"FRAM":
            points.append((len(data), number, int.from_bytes((payload or b"")[:4], "little")))
        frames += piece.kind in kinds
        data += piece.pack(number, payload or b"")
        number += 1
    return Layout(data, (*offsets, len(data)))


@dataclass
class Stream:
    """A stream that is being written.

    Attributes:
        head: Its HEAD.
        pieces: So far.
        states: States of its frames; None if a frame violates a clause.
        places: Indices of their pieces.
    """

    head: Head
    pieces: list[Piece] = field(default_factory=list)
    states: list[PlainState | None] = field(default_factory=list)
    places: list[int] = field(default_factory=list)
    payloads: list[Canonical | Snapshot | Frame] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.add(b"HEAD", self.head.pack())

    def add(self, kind: bytes, payload: bytes) -> "Stream":
        """Append a chunk that is not a frame."""
        self.pieces.append(Piece(kind, payload))
        return self

    def canonical(
        self, frame: int, gaussians: Iterable[Coded], stating: State = state_nothing, **said: Any
    ) -> "Stream":
        """Append a CANO chunk; one that violates a clause has no state, and ends the frames."""
        payload, state = make_canonical(self.head, frame, list(gaussians), stating, **said)
        return self._append(b"CANO", payload, state)

    def frame(self, change: Change = Change(), **said: Any) -> "Stream":  # noqa: B008, frozen
        """Append a FRAM chunk; see `canonical`."""
        before = self.states[-1]
        assert before is not None, "the previous frame violates a clause"
        payload, state = make_frame(self.head, before, change, **said)
        return self._append(b"FRAM", payload, state)

    def snapshot(
        self,
        survivors: Iterable[Survivor],
        newborn: Iterable[Coded] = (),
        stating: State = state_nothing,
        **said: Any,
    ) -> "Stream":
        """Append a SNAP chunk; see `canonical`."""
        before = self.states[-1]
        assert before is not None, "the previous frame violates a clause"
        kept, born = list(survivors), list(newborn)
        payload, state = make_snapshot(self.head, before, kept, born, stating, **said)
        return self._append(b"SNAP", payload, state)

    def end(self, *, index: bool = False) -> "Stream":
        """Append TAIL, after INDX."""
        if index:
            self.pieces.append(Piece(b"INDX", None))
        self.pieces.append(Piece(b"TAIL", None))
        return self

    def layout(self) -> Layout:
        """Return the stream as bytes."""
        return assemble(self.pieces)

    def decoded(self) -> list[Decoded]:
        """Return the expected output for its frames."""
        assert None not in self.states, "a frame violates a clause"
        return [describe(state) for state in self.states if state is not None]

    def frame_with(self, number: int, **said: Any) -> list[Piece]:
        """Return the pieces with changed fields in the payload of a frame."""
        payload = replace(self.payloads[number], **said).pack()
        return self.replaced(self.places[number], payload=payload)

    def replaced(self, place: int, **said: Any) -> list[Piece]:
        """Return the pieces with one of them changed."""
        return [
            *self.pieces[:place],
            replace(self.pieces[place], **said),
            *self.pieces[place + 1 :],
        ]

    def before(self, *pieces: Piece, place: int) -> list[Piece]:
        """Return the pieces with others inserted before one of them."""
        return [*self.pieces[:place], *pieces, *self.pieces[place:]]

    def without(self, *places: int) -> list[Piece]:
        """Return the pieces without some; the others keep their sequence numbers."""
        return [replace(p, sequence=n) for n, p in enumerate(self.pieces) if n not in places]

    def _append(
        self, kind: bytes, payload: Canonical | Snapshot | Frame, state: PlainState | None
    ) -> "Stream":
        self.places.append(len(self.pieces))
        self.pieces.append(Piece(kind, payload.pack()))
        self.payloads.append(payload)
        self.states.append(state)
        return self


def describe(state: PlainState) -> Decoded:
    """Return the expected output for a state."""
    return Decoded(state.frame, len(state.gaussians), state.digest())
