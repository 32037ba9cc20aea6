"""Makes small inputs, in resource/, that cost a careless decoder time or memory (SPEC 13)."""

import zlib
from dataclasses import replace

from making.payloads import MAGIC, Frame, pack_chunk, pack_chunk_header
from making.streams import Chunk, Stream
from making.vectors import (
    Gap,
    Outcome,
    Recovery,
    Splice,
    ValidStream,
    Vector,
    make_patched_vector,
    make_valid_stream,
)


def make_resource_vectors(
    journey: ValidStream, full: ValidStream, unlimited: ValidStream
) -> list[Vector]:
    """Return all vectors.

    Args:
        journey: `streams/journey`.
        full: A stream whose first frame has the maximum number of Gaussians of level 1.0, all at
            one position.
        unlimited: A stream of level 31.
    """
    return [
        _make_crowd_vector(full),
        *_make_huge_length_vectors(journey, unlimited),
        *_make_huge_count_vectors(unlimited),
        *_make_search_vectors(journey),
    ]


def _make_crowd_vector(full_stream: ValidStream) -> Vector:
    """Return a stream of 65536 motionless Gaussians at one position, all bound to anchor 0."""
    stream = Stream(replace(full_stream.stream.head, gaussians_per_anchor=16))
    stream.chunks.append(full_stream.stream.chunks[1])
    state = full_stream.stream.states[0]
    assert state is not None
    next_state = replace(state, frame=1, phase=1)
    crc = zlib.crc32(next_state.serialize(codes=False))
    stream.chunks.append(Chunk(b"FRAM", Frame(1, 0, 0, 0, (), (), crc).pack()))
    stream.states += [state, next_state]
    note = "65536 Gaussians at one position with 4096 anchors, in 259 bytes"
    return make_valid_stream("resource/crowd", note, "1-1", stream.finish()).vector


def _make_huge_length_vectors(journey: ValidStream, unlimited: ValidStream) -> list[Vector]:
    max_u32 = 0xFFFFFFFF
    data_before = journey.layout.data[: journey.layout.offsets[7]]
    head_data = MAGIC + pack_chunk_header(b"HEAD", 0, max_u32)
    end_offset = unlimited.layout.offsets[2]
    cases = [
        (
            journey,
            "length",
            data_before + pack_chunk_header(b"FRAM", 7, max_u32),
            journey.frames[:4],
            ("chunk-exceeds-level",),
            "the stream ends after the header of a FRAM of 2^32 - 1 bytes",
        ),
        (
            journey,
            "length-of-head",
            head_data,
            [],
            ("chunk-exceeds-level",),
            "the stream ends after the header of a HEAD of 2^32 - 1 bytes",
        ),
        (
            unlimited,
            "length-unlimited",
            unlimited.layout.data[:end_offset] + pack_chunk_header(b"FRAM", 2, max_u32) + bytes(99),
            unlimited.frames[:1],
            ("truncated",),
            "the stream ends after 99 of 2^32 - 1 payload bytes of a FRAM, at the unlimited level",
        ),
    ]
    return [
        make_patched_vector(
            parent,
            f"resource/{name}",
            "5.2-6 5.2-7 13-1",
            data,
            Outcome(frames, reject_ids, may_decline=parent is unlimited),
            note,
        )
        for parent, name, data, frames, reject_ids, note in cases
    ]


def _make_huge_count_vectors(unlimited: ValidStream) -> list[Vector]:
    max_u32 = 0xFFFFFFFF
    stream = unlimited.stream
    empty_sections = ((),) * 6
    with_max_gaussians = stream.replace_frame_fields(
        0, gaussian_count=max_u32, sections=empty_sections
    )
    with_max_births = stream.replace_frame_fields(1, birth_count=max_u32, births=())
    with_fewer_gaussians = stream.replace_frame_fields(
        0, gaussian_count=1 << 28, sections=empty_sections
    )
    cases = [
        (
            "gaussians",
            with_max_gaussians,
            0,
            ("state-crc",),
            "2^32 - 1 Gaussians in sections without words, at the unlimited level",
        ),
        (
            "gaussians-fewer",
            with_fewer_gaussians,
            0,
            ("state-crc",),
            "2^28 Gaussians in sections without words, at the unlimited level",
        ),
        (
            "births",
            with_max_births,
            1,
            ("state-crc", "count-exceeds-level"),
            "2^32 - 1 births in a section without words, at the unlimited level",
        ),
    ]
    return [
        make_patched_vector(
            unlimited,
            f"resource/{name}",
            "3.2-5 13-1",
            chunks,
            Outcome(unlimited.frames[:frame_count], reject_ids, may_decline=True),
            note,
        )
        for name, chunks, frame_count, reject_ids, note in cases
    ]


def _make_search_vectors(journey: ValidStream) -> list[Vector]:
    """Return streams with about 1 MiB of junk; the search for the next valid chunk must be fast."""
    offset, resume_offset = journey.layout.offsets[7], journey.layout.offsets[9]
    header = pack_chunk_header(b"CANO", 40, 1000)
    junk = {
        "search-sync-words": (
            bytes.fromhex("9E5143F3"),
            1 << 18,
            "header-crc",
            "2^18 sync words without chunks",
        ),
        "search-headers": (
            header,
            20000,
            "payload-crc sequence",
            "20000 chunk headers without valid payloads",
        ),
        "search-chunks": (
            pack_chunk(b"CANO", 40, bytes(40)),
            16000,
            "sequence",
            "16000 CANO chunks with an earlier ordinal",
        ),
    }
    vectors = []
    for name, (chunk, count, reject_ids, note) in junk.items():
        data = journey.layout.data[:offset] + chunk * count + journey.layout.data[offset:]
        reject_id_tuple = tuple(reject_ids.split())
        gap = Gap(offset, len(chunk) * count + resume_offset - offset, reject_id_tuple, 2)
        outcome = Outcome(journey.frames[:4], reject_id_tuple)
        vector = make_patched_vector(journey, f"resource/{name}", "13-2", data, outcome, note)
        recovery = Recovery([*journey.frames[:4], *journey.frames[6:]], (gap,))
        splices = (Splice(offset, 0, chunk, count),)
        vectors.append(replace(vector, recover=recovery, splices=splices, is_stored=False))
    return vectors
