"""Makes vectors in invalid/: faults in snapshots (SPEC 5.10, 7.9, 8.9)."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from making.changes import Survivor
from making.fault_rows import FaultRow
from making.frames import make_snapshot
from making.payloads import Snapshot
from making.scenes import make_cloud
from making.snapshot_damage import make_snapshot_damage, make_snapshot_junk
from making.snapshot_index_faults import make_snapshot_index_faults
from making.snapshot_scenes import (
    REQUIRED_CAPABILITY,
    make_differences,
    make_random_survivors,
    make_unchanged_survivors,
)
from making.streams import Chunk, assemble
from making.vectors import Gap, Outcome, Recovery, ValidStream, Vector, make_patched_vector
from making.word_faults import encode_stated_code

_SNAP_CHUNK_INDEX = 5
"""Index of the chunk of `streams/snapshots-journey` that holds frame 3, the first snapshot."""
_SNAP_ORDINAL = 3


def make_snapshot_faults(parent: ValidStream, journey: ValidStream) -> list[Vector]:
    """Return all vectors.

    Args:
        parent: `streams/snapshots-journey`.
        journey: `streams/journey`, which has no snapshots.
    """
    rows = [*_list_field_faults(parent), *_list_scene_faults(parent), *_list_word_faults(parent)]
    vectors = [
        *(_make_fault_vector(parent, *row) for row in rows),
        *make_snapshot_index_faults(parent),
        *make_snapshot_damage(parent),
        _make_snapshot_first_vector(parent),
        _make_earlier_reference(parent),
        *make_snapshot_junk(parent),
    ]
    return [
        *(replace(vector, **REQUIRED_CAPABILITY) for vector in vectors),
        _make_vector_without_feature(journey),
    ]


def _get_snapshot(parent: ValidStream) -> Snapshot:
    payload = parent.stream.frame_payloads[_SNAP_ORDINAL]
    assert isinstance(payload, Snapshot)
    return payload


def _make_fault_vector(
    parent: ValidStream, name: str, clauses: str, reject_ids: str, chunks: list[Chunk], note: str
) -> Vector:
    """Return a vector with a fault in the snapshot; recovery resumes at the next snapshot."""
    outcome = Outcome(parent.frames[:_SNAP_ORDINAL], tuple(reject_ids.split()))
    vector = make_patched_vector(parent, f"invalid/snapshot-{name}", clauses, chunks, outcome, note)
    offsets = assemble(chunks).offsets
    gap = Gap(
        offsets[_SNAP_CHUNK_INDEX],
        offsets[_SNAP_CHUNK_INDEX + 3] - offsets[_SNAP_CHUNK_INDEX],
        outcome.reject_ids,
        3,
    )
    frames = [*parent.frames[:_SNAP_ORDINAL], *parent.frames[_SNAP_ORDINAL + 3 :]]
    return replace(vector, recover=Recovery(frames, (gap,)))


def _list_field_faults(parent: ValidStream) -> Iterable[FaultRow]:
    snapshot = _get_snapshot(parent)

    def replace_fields(**fields: Any) -> list[Chunk]:
        payload = replace(snapshot, **fields).pack()
        return parent.stream.replace_chunk(_SNAP_CHUNK_INDEX, payload=payload)

    yield "repeated", "7.9-1", "frame-order", replace_fields(frame=2), "an ordinal is repeated"
    yield "skipped", "7.9-1", "frame-order", replace_fields(frame=4), "an ordinal is skipped"
    yield (
        "of-no-canonical",
        "7.9-2",
        "frame-order",
        replace_fields(canonical=1),
        "the snapshot refers to a frame that is not a CANO",
    )
    yield (
        "of-a-later-one",
        "7.9-2",
        "frame-order",
        replace_fields(canonical=8),
        "the snapshot refers to a later CANO",
    )
    with_count_beyond_level = replace_fields(newborn_count=65537)
    note = "one new Gaussian more than level 1.0 allows"
    yield (
        "newborn-beyond-level",
        "3.2-6 3.2-5",
        "count-exceeds-level",
        with_count_beyond_level,
        note,
    )
    with_max_count = replace_fields(newborn_count=(1 << 32) - 1)
    yield (
        "newborn-greatest",
        "3.2-6 3.2-5",
        "count-exceeds-level",
        with_max_count,
        "2^32 - 1 new Gaussians",
    )
    yield "axis-bits", "5-3", "field", replace_fields(axis_bits=21), "axis_bits is 21"
    with_wrong_crc = replace_fields(state_crc=snapshot.state_crc ^ 1)
    yield "state-crc", "9.2-1", "state-crc", with_wrong_crc, "one bit of the state CRC is flipped"
    payload = snapshot.pack()
    for name, data, reject_ids, clauses, note in (
        ("shorter", payload[:-1], "field", "5-1", "the last byte of a SNAP is missing"),
        (
            "longer",
            payload + b"\0",
            "trailing-data",
            "5-2",
            "an additional byte after the last field of a SNAP",
        ),
    ):
        yield (
            name,
            clauses,
            reject_ids,
            parent.stream.replace_chunk(_SNAP_CHUNK_INDEX, payload=data),
            note,
        )


def _list_scene_faults(parent: ValidStream) -> Iterable[FaultRow]:
    previous = parent.stream.states[_SNAP_ORDINAL - 1]
    assert previous is not None
    assert previous.canonical is not None
    _, canonical_gaussians = previous.canonical

    def make_chunks(
        survivors: Iterable[Survivor], newborn: Iterable[Any] = (), **overrides: Any
    ) -> list[Chunk]:
        snapshot, _ = make_snapshot(
            parent.stream.head, previous, list(survivors), list(newborn), **overrides
        )
        return parent.stream.replace_chunk(_SNAP_CHUNK_INDEX, payload=snapshot.pack())

    unchanged_snapshot, _ = make_snapshot(
        parent.stream.head, previous, make_unchanged_survivors(range(12))
    )
    too_many = replace(unchanged_snapshot, newborn_count=65537 - 12, sections=((),) * 6)
    yield (
        "sum-beyond-level",
        "3.2-6 3.2-5",
        "count-exceeds-level",
        parent.stream.replace_chunk(_SNAP_CHUNK_INDEX, payload=too_many.pack()),
        "survivors and new Gaussians together are one more than level 1.0 allows",
    )
    yield "empty", "7.9-3", "count", make_chunks(()), "the snapshot has no Gaussians"
    distant_newborn = [replace(make_cloud(1, 5)[0], position=(1 << 20, 0, 0))]
    wide_scene = make_chunks(make_unchanged_survivors(range(12)), distant_newborn)
    yield (
        "wide",
        "7.9-4",
        "symbol-range position-range",
        wide_scene,
        "two positions are 2^20 steps or more apart",
    )
    left = min(gaussian.position[0] for gaussian in canonical_gaussians)
    far_newborn = [replace(make_cloud(1, 5)[0], position=(left + (1 << 20), 0, 0))]
    wide_scene = make_chunks(make_unchanged_survivors(range(12)), far_newborn)
    yield "wide-by-one", "7.9-4", "symbol-range", wide_scene, "two positions are 2^20 steps apart"
    newborn_at_edge = [replace(make_cloud(1, 5)[0], position=(1 << 21, 0, 0))]
    note = "a position just beyond the lattice"
    yield "position", "7.9-5 4.1-1", "position-range", make_chunks((), newborn_at_edge), note
    for number, name in enumerate(("log-scale", "opacity", "red")):
        row = (7, 10, 11)[number]
        codes = [gaussian.codes[row - 7] for gaussian in canonical_gaussians]
        i = next(i for i, code in enumerate(codes) if code)
        values = [0] * 14
        values[row] = 32767 if codes[i] > 0 else -32767
        chunks = make_chunks([Survivor(i, tuple(values))])
        yield name, "7.9-5 4.1-1", "code-range", chunks, f"the magnitude of {name} is above 32767"
    with_wrong_rotation = make_chunks([Survivor(0, make_differences(rotation=(1, 256, 1, 0)))])
    note = "a rotation whose norm is slightly above 1"
    yield "rotation", "7.9-5", "rotation-range", with_wrong_rotation, note
    with_wrong_rotation = make_chunks([Survivor(0, make_differences(rotation=(0, 600, 0, 0)))])
    yield (
        "component",
        "7.9-5",
        "rotation-range",
        with_wrong_rotation,
        "a rotation component above 1",
    )
    other_snapshot, _ = make_snapshot(
        parent.stream.head, previous, make_random_survivors(range(9), 9)
    )
    chunks = parent.stream.replace_chunk(
        _SNAP_CHUNK_INDEX, payload=replace(other_snapshot, state_crc=1).pack()
    )
    yield (
        "of-another-frame",
        "9.2-1",
        "state-crc",
        chunks,
        "the state CRC does not match the snapshot",
    )


def _list_word_faults(parent: ValidStream) -> Iterable[FaultRow]:
    snapshot, unconsumed_id = _get_snapshot(parent), "unconsumed-words"

    def replace_survivor_words(words: tuple[int, ...]) -> list[Chunk]:
        payload = replace(snapshot, survivors=words).pack()
        return parent.stream.replace_chunk(_SNAP_CHUNK_INDEX, payload=payload)

    words = tuple(snapshot.survivors)
    yield (
        "words-end-in-zero",
        "8.3-1",
        "invalid-words",
        replace_survivor_words((*words, 0)),
        "the survivors section ends with a zero word",
    )
    yield (
        "words-left",
        "8.3-2 8.3-3",
        unconsumed_id,
        replace_survivor_words((7, *words)),
        "an extra word before the first word of the survivors section",
    )
    yield (
        "words-left-zero",
        "8.3-3",
        unconsumed_id,
        replace_survivor_words((0, *words)),
        "an extra zero word before the first word of the survivors section",
    )
    for code in (240, 255):
        chunks = replace_survivor_words(tuple(encode_stated_code(code)))
        yield (
            f"probability-{code}",
            "8.2-1",
            "bad-probability",
            chunks,
            f"a stated probability code of {code}",
        )


def _make_snapshot_first_vector(parent: ValidStream) -> Vector:
    """Return a stream whose first frame is a snapshot."""
    chunks = [p for n, p in enumerate(parent.stream.chunks) if n not in (2, 3, 4)]
    outcome = Outcome((), ("chunk-order",))
    note = "a snapshot precedes the first CANO"
    return make_patched_vector(parent, "invalid/snapshot-first", "5.1-3", chunks, outcome, note)


def _make_earlier_reference(parent: ValidStream) -> Vector:
    """Return a stream whose last snapshot refers to the first of two CANO chunks."""
    return make_patched_vector(
        parent,
        "invalid/snapshot-of-an-earlier-one",
        "7.9-2",
        parent.stream.replace_frame_fields(10, canonical=0),
        Outcome(parent.frames[:10], ("frame-order",)),
        "the snapshot refers to a CANO that is not the last one",
    )


def _make_vector_without_feature(journey: ValidStream) -> Vector:
    chunk_index = next(n for n, chunk in enumerate(journey.stream.chunks) if chunk.kind == b"FRAM")
    snapshot = Snapshot(1, 0, 0, (0, 0, 0), 0, (), ((),) * 6, 0).pack()
    chunks = journey.stream.insert_chunks(Chunk(b"SNAP", snapshot), index=chunk_index)
    outcome = Outcome(journey.frames[:1], ("unknown-critical",))
    note = "a SNAP in a stream without FEATURE_SNAPSHOTS"
    vector = make_patched_vector(
        journey, "invalid/snapshot-without-the-feature", "5.2-9", chunks, outcome, note
    )
    return replace(vector, recover=Recovery(outcome.frames, reject_ids=outcome.reject_ids))
