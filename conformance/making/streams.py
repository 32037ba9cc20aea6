"""Builds streams from chunks: adds sequence numbers, CRCs, INDX and TAIL.

A stream is a list of chunks. To make a fault, a chunk is replaced, added, removed or damaged; then
INDX and TAIL are computed from all chunks.
"""

import struct
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

from making.changes import Change, CodedGaussian, Survivor, choose_no_code
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
from making.writing import CodeChoice
from plain.state import PlainState

FRAME_TYPES = (b"CANO", b"SNAP", b"FRAM")


@dataclass(frozen=True)
class DecodedFrame:
    """The expected output for a frame: its ordinal, number of Gaussians and digest."""

    frame: int
    gaussians: int
    sha256: str


@dataclass(frozen=True)
class Chunk:
    """A chunk to write.

    Attributes:
        kind: Type of the chunk.
        payload: Bytes of the payload; None for an INDX or TAIL that is computed from the stream.
        sequence: Sequence number that replaces the correct one.
        flipped_byte: Index of a byte whose lowest bit is flipped after the CRCs are computed.
        skipped_sequence_numbers: How many sequence numbers to skip before the chunk.
    """

    kind: bytes
    payload: bytes | None
    sequence: int | None = None
    flipped_byte: int | None = None
    skipped_sequence_numbers: int = 0

    def pack(self, expected_sequence: int, payload: bytes) -> bytes:
        """Return the bytes of the chunk, given its correct sequence number and its payload."""
        sequence = expected_sequence if self.sequence is None else self.sequence
        header = pack_chunk_header(self.kind, sequence, len(payload))
        data = header + payload + struct.pack("<I", zlib.crc32(payload))
        if self.flipped_byte is None:
            return data
        flipped = bytearray(data)
        flipped[self.flipped_byte] ^= 1
        return bytes(flipped)


@dataclass(frozen=True)
class Layout:
    """A stream and the offsets of its chunks.

    Attributes:
        data: Bytes of the stream.
        offsets: Offset of each chunk, followed by the size of the stream.
    """

    data: bytes
    offsets: tuple[int, ...]


def assemble(chunks: Iterable[Chunk]) -> Layout:
    """Number the chunks and add their CRCs; generate INDX and TAIL."""
    data, offsets, seek_points, sequence = MAGIC, [], [], 0
    frame_count, index_offset, frame_types = 0, 0, (b"CANO", b"FRAM")
    for chunk in chunks:
        if chunk.kind == b"HEAD" and (chunk.payload or bytes(3))[2] & 4:
            frame_types = FRAME_TYPES
        offsets.append(len(data))
        sequence += chunk.skipped_sequence_numbers
        payload = chunk.payload
        if chunk.kind == b"INDX":
            index_offset = index_offset or len(data)
            payload = pack_index(seek_points) if payload is None else payload
        elif chunk.kind == b"TAIL" and payload is None:
            payload = pack_tail(frame_count, len(seek_points), index_offset)
        elif chunk.kind in frame_types and chunk.kind != b"FRAM":
            seek_points.append(
                (len(data), sequence, int.from_bytes((payload or b"")[:4], "little"))
            )
        frame_count += chunk.kind in frame_types
        data += chunk.pack(sequence, payload or b"")
        sequence += 1
    return Layout(data, (*offsets, len(data)))


@dataclass
class Stream:
    """A stream that is being written.

    Attributes:
        head: Fields of HEAD.
        chunks: Chunks that have been added.
        states: State after each frame; None if the frame violates a clause.
        frame_chunk_indices: Index of the chunk of each frame.
        frame_payloads: Fields of the payload of each frame.
    """

    head: Head
    chunks: list[Chunk] = field(default_factory=list)
    states: list[PlainState | None] = field(default_factory=list)
    frame_chunk_indices: list[int] = field(default_factory=list)
    frame_payloads: list[Canonical | Snapshot | Frame] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.add_chunk(b"HEAD", self.head.pack())

    def add_chunk(self, kind: bytes, payload: bytes) -> "Stream":
        """Append a chunk that is not a frame."""
        self.chunks.append(Chunk(kind, payload))
        return self

    def add_canonical(
        self,
        frame: int,
        gaussians: Iterable[CodedGaussian],
        choose_code: CodeChoice = choose_no_code,
        **overrides: Any,
    ) -> "Stream":
        """Append a CANO chunk; no frame can follow if an override violates a clause."""
        payload, state = make_canonical(self.head, frame, list(gaussians), choose_code, **overrides)
        return self._append(b"CANO", payload, state)

    def add_frame(self, change: Change = Change(), **overrides: Any) -> "Stream":  # noqa: B008, frozen
        """Append a FRAM chunk; see `add_canonical`."""
        previous = self.states[-1]
        assert previous is not None, "the previous frame violates a clause"
        payload, state = make_frame(self.head, previous, change, **overrides)
        return self._append(b"FRAM", payload, state)

    def add_snapshot(
        self,
        survivors: Iterable[Survivor],
        newborn: Iterable[CodedGaussian] = (),
        choose_code: CodeChoice = choose_no_code,
        **overrides: Any,
    ) -> "Stream":
        """Append a SNAP chunk; see `add_canonical`."""
        previous = self.states[-1]
        assert previous is not None, "the previous frame violates a clause"
        survivor_list, newborn_list = list(survivors), list(newborn)
        payload, state = make_snapshot(
            self.head, previous, survivor_list, newborn_list, choose_code, **overrides
        )
        return self._append(b"SNAP", payload, state)

    def finish(self, *, index: bool = False) -> "Stream":
        """Append TAIL; if `index` is true, append INDX first."""
        if index:
            self.chunks.append(Chunk(b"INDX", None))
        self.chunks.append(Chunk(b"TAIL", None))
        return self

    def make_layout(self) -> Layout:
        """Return the bytes of the stream, and the offsets of its chunks."""
        return assemble(self.chunks)

    def list_decoded_frames(self) -> list[DecodedFrame]:
        """Return the expected output for the frames of the stream."""
        assert None not in self.states, "a frame violates a clause"
        return [describe_state(state) for state in self.states if state is not None]

    def replace_frame_fields(self, frame_index: int, **fields: Any) -> list[Chunk]:
        """Return the chunks, with some fields of a frame's payload replaced."""
        payload = replace(self.frame_payloads[frame_index], **fields).pack()
        return self.replace_chunk(self.frame_chunk_indices[frame_index], payload=payload)

    def replace_chunk(self, index: int, **fields: Any) -> list[Chunk]:
        """Return the chunks, with some fields of the chunk at `index` replaced."""
        return [
            *self.chunks[:index],
            replace(self.chunks[index], **fields),
            *self.chunks[index + 1 :],
        ]

    def insert_chunks(self, *chunks: Chunk, index: int) -> list[Chunk]:
        """Return the chunks with additional chunks inserted at `index`."""
        return [*self.chunks[:index], *chunks, *self.chunks[index:]]

    def drop_chunks(self, *indices: int) -> list[Chunk]:
        """Return all chunks except those at `indices`, with unchanged sequence numbers."""
        return [
            replace(chunk, sequence=sequence)
            for sequence, chunk in enumerate(self.chunks)
            if sequence not in indices
        ]

    def _append(
        self, kind: bytes, payload: Canonical | Snapshot | Frame, state: PlainState | None
    ) -> "Stream":
        self.frame_chunk_indices.append(len(self.chunks))
        self.chunks.append(Chunk(kind, payload.pack()))
        self.frame_payloads.append(payload)
        self.states.append(state)
        return self


def describe_state(state: PlainState) -> DecodedFrame:
    """Return the expected output for a state."""
    return DecodedFrame(state.frame, len(state.gaussians), state.compute_digest())
