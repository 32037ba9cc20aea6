"""Makes the streams in invalid/ with one fault in the container (SPEC 5.1, 5.2, 5.8, 5.9, 12)."""

from collections.abc import Iterable
from dataclasses import replace

from making.end_faults import make_end_faults
from making.fault_rows import (
    CAME_CHUNK_INDEX,
    FRAM_CHUNK_INDEX,
    HEAD_CHUNK_INDEX,
    INDX_CHUNK_INDEX,
    META_CHUNK_INDEX,
    NOTE_CHUNK_INDEX,
    TAIL_CHUNK_INDEX,
    FaultRow,
    count_frames,
    make_faults_at,
)
from making.head_faults import make_magic_and_head_faults
from making.payloads import pack_metadata
from making.streams import Chunk, assemble
from making.vectors import Gap, Outcome, Recovery, ValidStream, Vector, make_patched_vector


def make_container_faults(parent: ValidStream) -> list[Vector]:
    """Return the vectors of this module, as patches of `streams/journey`."""
    rows = [*_make_framing_faults(parent), *_make_type_faults(parent)]
    return [
        *make_faults_at(parent, FRAM_CHUNK_INDEX, rows),
        *make_magic_and_head_faults(parent),
        *_make_order_faults(parent),
        *make_end_faults(parent),
        *_make_ancillary_faults(parent),
    ]


def _make_framing_faults(parent: ValidStream) -> Iterable[FaultRow]:
    stream = parent.stream
    bit_flips: list[tuple[str, str, str, int, str]] = [
        ("sync", "5.2-1", "bad-sync", 0, "one bit of the first byte of a sync word is flipped"),
        ("sync-end", "5.2-1", "bad-sync", 3, "one bit of the last byte of a sync word is flipped"),
        (
            "header-crc-of-the-type",
            "5.2-2 5.2-5",
            "header-crc",
            4,
            "one bit of a chunk type is flipped",
        ),
        (
            "header-crc-of-the-sequence",
            "5.2-2 5.2-5",
            "header-crc",
            8,
            "one bit of a sequence number is flipped",
        ),
        (
            "header-crc-of-the-length",
            "5.2-2 5.2-5",
            "header-crc",
            15,
            "one bit of a length is flipped, which increases the length by 16 MiB",
        ),
        ("header-crc", "5.2-2", "header-crc", 16, "one bit of a header's CRC is flipped"),
        (
            "payload-crc-of-the-payload",
            "5.2-3 5.2-5",
            "payload-crc",
            25,
            "one bit of a payload is flipped",
        ),
        ("payload-crc", "5.2-3", "payload-crc", -1, "one bit of a payload's CRC is flipped"),
    ]
    for name, clauses, reject_ids, byte_index, note in bit_flips:
        yield (
            name,
            clauses,
            reject_ids,
            stream.replace_chunk(FRAM_CHUNK_INDEX, flipped_byte=byte_index),
            note,
        )
    yield (
        "payload-crc-of-zero",
        "5.2-3",
        "payload-crc",
        _replace_crc_with_zero(stream.chunks),
        "the payload CRC is 0, which does not mean that it is absent",
    )
    yield (
        "sequence-skipped",
        "5.2-4",
        "sequence",
        stream.replace_chunk(FRAM_CHUNK_INDEX, sequence=FRAM_CHUNK_INDEX + 1),
        "a sequence number is skipped",
    )
    yield (
        "sequence-repeated",
        "5.2-4",
        "sequence",
        stream.replace_chunk(FRAM_CHUNK_INDEX, sequence=FRAM_CHUNK_INDEX - 1),
        "a sequence number is repeated",
    )
    yield (
        "sequence-from-zero",
        "5.2-4 5.1-2",
        "sequence",
        stream.replace_chunk(FRAM_CHUNK_INDEX, sequence=0),
        "the sequence numbers start again at 0",
    )


def _replace_crc_with_zero(chunks: list[Chunk]) -> list[Chunk]:
    """Return the chunks with the payload CRC of a FRAM chunk set to 0."""
    return [
        *chunks[:FRAM_CHUNK_INDEX],
        _ZeroCrcChunk(chunks[FRAM_CHUNK_INDEX].kind, chunks[FRAM_CHUNK_INDEX].payload),
        *chunks[FRAM_CHUNK_INDEX + 1 :],
    ]


class _ZeroCrcChunk(Chunk):
    def pack(self, expected_sequence: int, payload: bytes) -> bytes:
        return super().pack(expected_sequence, payload)[:-4] + bytes(4)


def _make_type_faults(parent: ValidStream) -> Iterable[FaultRow]:
    type_faults = {
        "digit": (b"FR4M", "bad-chunk-type", "a digit"),
        "space": (b"FRA ", "bad-chunk-type", "a space"),
        "mixed-case": (b"FRaM", "bad-chunk-type", "a lowercase third letter"),
        "mixed-case-ancillary": (b"caMe", "bad-chunk-type", "an uppercase third letter"),
        "last-case": (b"FRAm", "bad-chunk-type", "a lowercase fourth letter"),
        "latin-1": (b"FR\xc1M", "bad-chunk-type", "a letter outside ASCII"),
        "bracket": (b"[RAM", "bad-chunk-type", "the character [, which follows Z in ASCII"),
        "underscore": (b"no_e", "bad-chunk-type", "the character _, which is between Z and a"),
        "zeros": (bytes(4), "bad-chunk-type", "four zero bytes"),
    }
    for name, (kind, reject_ids, note) in type_faults.items():
        yield (
            f"type-{name}",
            "5.2-8",
            reject_ids,
            parent.stream.replace_chunk(FRAM_CHUNK_INDEX, kind=kind),
            f"a chunk type with {note}",
        )


def _make_order_faults(parent: ValidStream) -> list[Vector]:
    """Return streams with chunks in positions where their types are not allowed."""
    stream, reject_ids = parent.stream, "chunk-order"
    head, index, tail = stream.chunks[HEAD_CHUNK_INDEX], Chunk(b"INDX", None), Chunk(b"TAIL", None)
    with_later_head = stream.insert_chunks(head, index=FRAM_CHUNK_INDEX)
    with_frame_first = [head, *stream.chunks[3:5], stream.chunks[2], *stream.chunks[5:]]
    with_chunk_after_index = [
        *stream.chunks[:INDX_CHUNK_INDEX],
        index,
        Chunk(b"meta", pack_metadata()),
        tail,
    ]
    with_second_index, frame_count = (
        stream.insert_chunks(index, index=TAIL_CHUNK_INDEX),
        len(parent.frames),
    )
    note = "a second HEAD, with the expected sequence number"
    rows = (
        ("head-not-first", "5.1-2", reject_ids, stream.chunks[1:], 0, "the first chunk is `came`"),
        ("head-missing", "5.1-2", reject_ids, stream.chunks[2:], 0, "the first chunk is CANO"),
        (
            "head-not-first-long",
            "5.1-2",
            reject_ids,
            [Chunk(b"note", bytes(1025)), *stream.chunks],
            0,
            "the first chunk is not HEAD, and is longer than a HEAD can be",
        ),
        (
            "frame-before-canonical",
            "5.1-3",
            reject_ids,
            with_frame_first,
            0,
            "a FRAM precedes the first CANO",
        ),
        (
            "chunk-after-index",
            "5.1-6",
            reject_ids,
            with_chunk_after_index,
            frame_count,
            "`meta` is between INDX and TAIL",
        ),
        ("index-twice", "5.1-6", reject_ids, with_second_index, frame_count, "INDX comes twice"),
        *_make_critical_chunk_faults(parent),
    )
    return [
        *make_faults_at(
            parent, FRAM_CHUNK_INDEX, [("head-later", "5.1-2", reject_ids, with_later_head, note)]
        ),
        *(_make_fault_after_frames(parent, *row) for row in rows),
    ]


def _make_critical_chunk_faults(
    parent: ValidStream,
) -> Iterable[tuple[str, str, str, list[Chunk], int, str]]:
    stream, reject_ids = parent.stream, "unknown-critical"
    with_reserved_type = stream.insert_chunks(Chunk(b"SNAP", bytes(8)), index=FRAM_CHUNK_INDEX)
    with_private_type = stream.insert_chunks(Chunk(b"FrAM", bytes(8)), index=FRAM_CHUNK_INDEX)
    with_head_numbered_1 = stream.replace_chunk(HEAD_CHUNK_INDEX, sequence=1)
    yield (
        "critical",
        "5.2-9",
        reject_ids,
        with_reserved_type,
        4,
        "a critical chunk of a reserved type",
    )
    yield (
        "critical-private",
        "5.2-9",
        reject_ids,
        with_private_type,
        4,
        "a critical chunk of a private type",
    )
    yield (
        "head-number",
        "5.2-4",
        "sequence chunk-order",
        with_head_numbered_1,
        0,
        "HEAD has sequence number 1",
    )


def _make_fault_after_frames(
    parent: ValidStream,
    name: str,
    clauses: str,
    reject_ids: str,
    chunks: list[Chunk],
    frame_count: int,
    note: str,
) -> Vector:
    """Return a vector that decoders reject after `frame_count` frames; recovery is not tested."""
    outcome = Outcome(parent.frames[:frame_count], tuple(reject_ids.split()))
    return make_patched_vector(parent, f"invalid/{name}", clauses, chunks, outcome, note)


def _make_ancillary_faults(parent: ValidStream) -> list[Vector]:
    """Return streams in which an ancillary chunk has a wrong payload CRC."""
    stream = parent.stream
    vectors = []
    for name, chunk_index, flipped_byte in (
        ("note", NOTE_CHUNK_INDEX, 22),
        ("came", CAME_CHUNK_INDEX, 40),
        ("meta", META_CHUNK_INDEX, 30),
    ):
        chunks = stream.replace_chunk(chunk_index, flipped_byte=flipped_byte)
        frame_count = count_frames(chunks[:chunk_index])
        layout = assemble(chunks)
        gap = Gap(
            layout.offsets[chunk_index],
            layout.offsets[chunk_index + 1] - layout.offsets[chunk_index],
            ("payload-crc",),
            0,
        )
        outcome = Outcome(parent.frames[:frame_count], ("payload-crc",))
        note = f"one bit of the payload of `{name}` is flipped; ancillary chunks are checked too"
        vector = make_patched_vector(
            parent, f"invalid/payload-crc-of-{name}", "5.2-3 5.2-10", chunks, outcome, note
        )
        vectors.append(replace(vector, recover=Recovery(parent.frames, (gap,))))
    return vectors
