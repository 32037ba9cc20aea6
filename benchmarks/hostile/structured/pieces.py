"""Assembles chunks, some of which may have faults, into a stream with INDX and TAIL."""

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

from quarc_ref.format import container, wire
from quarc_ref.format.constants import MAGIC, SYNC
from quarc_ref.format.records import SeekPoint, Tail
from quarc_ref.streams.resync import parse_ordinal


@dataclass(frozen=True, slots=True)
class Piece:
    """A chunk to assemble.

    Attributes:
        kind: Type of the chunk.
        payload: Payload of the chunk; None for INDX and TAIL, whose payloads are generated.
        sequence: Sequence number to write; None for the correct number.
        length: Payload length to write; None for the correct length.
        sync: Sync word.
        flipped_byte: Index of the byte in which one bit is flipped after the CRCs are computed;
            None to flip no bit.
    """

    kind: bytes
    payload: bytes | None
    sequence: int | None = None
    length: int | None = None
    sync: bytes = SYNC
    flipped_byte: int | None = None

    def pack(self, number: int, payload: bytes) -> bytes:
        """Return the bytes of the chunk, given its number in the stream."""
        sequence = number if self.sequence is None else self.sequence
        length = len(payload) if self.length is None else self.length
        header = self.sync + self.kind + struct.pack("<II", sequence, length)
        crcs = struct.pack("<I", zlib.crc32(header)), struct.pack("<I", zlib.crc32(payload))
        data = bytearray(header + crcs[0] + payload + crcs[1])
        if self.flipped_byte is not None:
            data[self.flipped_byte % len(data)] ^= 1
        return bytes(data)


def assemble(pieces: Sequence[Piece]) -> bytes:
    """Return the stream that consists of the pieces."""
    seek_points: list[SeekPoint] = []
    data, frames, index_offset = MAGIC, 0, 0
    for number, piece in enumerate(pieces):
        payload = piece.payload
        if payload is None and piece.kind == container.INDX:
            payload = wire.build_index(seek_points)
        if payload is None:
            payload = wire.build_tail(Tail(frames, len(seek_points), index_offset))
        if piece.kind == container.INDX:
            index_offset = len(data)
        if piece.kind in container.CANONICAL_TYPES:
            seek_points.append(SeekPoint(len(data), number, parse_ordinal(payload)))
        frames += piece.kind in container.FRAME_TYPES
        data += piece.pack(number, payload)
    return data
