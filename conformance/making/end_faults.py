"""Makes vectors in invalid/: faults in INDX and TAIL, and data after TAIL (SPEC 5.8, 5.9)."""

from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import INDX_CHUNK_INDEX, TAIL_CHUNK_INDEX
from making.payloads import pack_index, pack_tail
from making.streams import Chunk
from making.vectors import Outcome, ValidStream, Vector, make_patched_vector

_MISLEADING_SUFFIXES = ("-offset", "-sequence", "-frame", "-less", "-more", "-empty")
EndFault = tuple[str, str, str, list[Chunk] | bytes, str]
"""Name, clauses, reject ids, stream, and description."""


def make_end_faults(parent: ValidStream) -> list[Vector]:
    """Return streams that decoders reject after they have decoded all frames."""
    vectors = []
    # If a payload is too short, a decoder may check its fields before its length.
    for name, clauses, reject_ids, changed_stream, note in [
        *_make_payload_faults(parent),
        *_make_trailing_faults(parent),
        *_make_index_faults(parent),
        *_make_tail_faults(parent),
    ]:
        outcome = Outcome(parent.frames, tuple(reject_ids.split()))
        vector = make_patched_vector(
            parent, f"invalid/{name}", clauses, changed_stream, outcome, note
        )
        vectors.append(replace(vector, seek=_list_seek_outcomes(name)))
    return vectors


def _make_payload_faults(parent: ValidStream) -> Iterable[EndFault]:
    index, tail = pack_index(_list_seek_points(parent)), pack_tail(*_list_tail_fields(parent))
    index_with_huge_count, note = (
        b"\xff" * 4 + index[4:],
        "INDX states 2^32 - 1 seek points but contains three",
    )
    wrapping_index = ((1 << 28) + 3).to_bytes(4, "little") + index[4:]
    cases = {
        "index-count-wraps": (
            INDX_CHUNK_INDEX,
            wrapping_index,
            "5-1",
            "field index-mismatch",
            "INDX states 2^28 + 3 seek points, which have the size of three in 32 bits",
        ),
        "tail-shorter": (
            TAIL_CHUNK_INDEX,
            bytes(15),
            "5-1",
            "field tail-mismatch",
            "TAIL of 15 bytes",
        ),
        "tail-longer": (TAIL_CHUNK_INDEX, tail + b"\0", "5-2", "trailing-data", "TAIL of 17 bytes"),
        "index-count": (
            INDX_CHUNK_INDEX,
            index_with_huge_count,
            "5-1",
            "field index-mismatch",
            note,
        ),
        "index-longer": (
            INDX_CHUNK_INDEX,
            index + b"\0",
            "5-2",
            "trailing-data",
            "an additional byte at the end of INDX",
        ),
    }
    for name, (chunk_index, payload, clauses, reject_ids, note) in cases.items():
        yield (
            name,
            clauses,
            reject_ids,
            parent.stream.replace_chunk(chunk_index, payload=payload),
            note,
        )


def _make_trailing_faults(parent: ValidStream) -> Iterable[EndFault]:
    stream, data = parent.stream, parent.layout.data
    chunk_after_tail = stream.insert_chunks(Chunk(b"note", b""), index=TAIL_CHUNK_INDEX + 1)
    without_index = [
        *stream.chunks[:INDX_CHUNK_INDEX],
        Chunk(b"TAIL", pack_tail(*_list_tail_fields(parent))),
    ]
    clauses_and_ids = ("5.1-5", "trailing-data")
    yield "after-tail", *clauses_and_ids, data + b"\0", "an additional byte after TAIL"
    yield "after-tail-chunk", *clauses_and_ids, chunk_after_tail, "an additional chunk after TAIL"
    yield (
        "after-tail-stream",
        *clauses_and_ids,
        data * 2,
        "a second copy of the stream follows TAIL",
    )
    note = "TAIL states the offset of an INDX that is missing"
    yield "index-offset-of-none", "5.8-1", "tail-mismatch", without_index, note
    yield (
        "no-tail",
        "5.1-4",
        "truncated",
        stream.chunks[:TAIL_CHUNK_INDEX],
        "the stream ends after INDX",
    )


def _make_index_faults(parent: ValidStream) -> Iterable[EndFault]:
    first, (offset, sequence, frame), last = seek_points = _list_seek_points(parent)
    index_faults = {
        "index-offset": (
            [first, (offset + 1, sequence, frame), last],
            "an offset in INDX is 1 too large",
        ),
        "index-sequence": (
            [first, (offset, sequence + 1, frame), last],
            "a sequence number in INDX is 1 too large",
        ),
        "index-frame": (
            [first, (offset, sequence, frame + 1), last],
            "an ordinal in INDX is 1 too large",
        ),
        "index-order": ([seek_points[1], first, last], "two seek points are swapped in INDX"),
        "index-less": (seek_points[:2], "a seek point is missing in INDX"),
        "index-more": ([*seek_points, last], "a seek point is repeated in INDX"),
        "index-empty": ([], "INDX has no seek points although the stream has frames"),
    }
    for name, (listed_points, note) in index_faults.items():
        chunks = parent.stream.replace_chunk(INDX_CHUNK_INDEX, payload=pack_index(listed_points))
        yield name, "5.9-1 5.9-2", "index-mismatch", chunks, note


def _make_tail_faults(parent: ValidStream) -> Iterable[EndFault]:
    frame_count, canonical_count, offset = _list_tail_fields(parent)
    tail_faults = {
        "tail-frames": (
            pack_tail(frame_count + 1, canonical_count, offset),
            "frame_count of TAIL is 1 too large",
        ),
        "tail-canonicals": (
            pack_tail(frame_count, canonical_count - 1, offset),
            "canonical_count of TAIL is 1 too small",
        ),
        "tail-fewer-frames": (
            pack_tail(frame_count - 1, canonical_count, offset),
            "frame_count of TAIL is 1 too small",
        ),
        "tail-more-canonicals": (
            pack_tail(frame_count, canonical_count + 1, offset),
            "canonical_count of TAIL is 1 too large",
        ),
        "tail-index": (
            pack_tail(frame_count, canonical_count, offset + 1),
            "index_offset of TAIL is 1 too large",
        ),
        "tail-no-index": (
            pack_tail(frame_count, canonical_count, 0),
            "index_offset of TAIL is 0 although INDX exists",
        ),
    }
    for name, (payload, note) in tail_faults.items():
        chunks = parent.stream.replace_chunk(TAIL_CHUNK_INDEX, payload=payload)
        yield name, "5.8-1 5.8-2", "tail-mismatch", chunks, note


def _list_seek_outcomes(name: str) -> tuple[tuple[int, Outcome], ...]:
    """Return the expected output of seeking to frame 4, if the fault affects seeking."""
    is_misleading = name.startswith("index-") and name.endswith(_MISLEADING_SUFFIXES)
    return ((4, Outcome((), ("index-mismatch",))),) if is_misleading else ()


def _list_tail_fields(parent: ValidStream) -> tuple[int, int, int]:
    """Return the correct frame count, canonical count and index offset for TAIL."""
    return (
        len(parent.frames),
        len(_list_seek_points(parent)),
        parent.layout.offsets[INDX_CHUNK_INDEX],
    )


def _list_seek_points(parent: ValidStream) -> list[tuple[int, int, int]]:
    chunks, offsets = parent.stream.chunks, parent.layout.offsets
    canonical_indices = [n for n, chunk in enumerate(chunks) if chunk.kind == b"CANO"]
    return [(offsets[n], n, frame) for n, frame in zip(canonical_indices, (0, 3, 6), strict=True)]
