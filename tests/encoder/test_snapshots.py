"""Tests of snapshots in the closed loop, and in all operations on streams (SPEC 7.9, 11)."""

import io
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.decoder.digest import compute_digest
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.config import make_header
from quarc_ref.encoder.stream_file import encode_file
from quarc_ref.format import container, wire
from quarc_ref.format.coding.gaussian_planes import read_canonical
from quarc_ref.format.coding.snapshot_planes import (
    SURVIVOR_FIELDS,
    compute_differences,
    read_snapshot,
)
from quarc_ref.format.errors import CountLevelError
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams import Gap, decode, recover
from quarc_ref.streams.chunk_reader import split_chunks
from tests.encoder.toys import SMALL, make_capture
from tests.small_streams import (
    CAMERA,
    CountedSource,
    make_births,
    make_gaussians,
    make_symbols,
    make_updates,
    rebuild_stream,
)
from tests.streams.edits import cut_bytes, join_bytes

_HEADER = StreamHeader(seed=3, gaussians_per_anchor=4, updates=True, snapshots=True)
_SNAPSHOTS, _CANONICAL, _FRAMES = (3, 6, 11), 8, 13


def _make_stream() -> tuple[bytes, list[str]]:
    sink = io.BytesIO()
    loop = ClosedLoop(sink, _HEADER, (CAMERA,), {})
    states = [loop.commit_canonical(make_gaussians(_HEADER, 50), 0)]
    for frame in range(1, _FRAMES):
        start = loop.start_frame(1)
        symbols, updates = make_symbols(start.state, frame), make_updates(start.state, frame)
        moved_frame = loop.move_frame(start, symbols, updates)
        commit = loop.commit_frame
        if frame in _SNAPSHOTS:
            commit = loop.commit_as_snapshot
        elif frame == _CANONICAL:
            commit = loop.commit_as_canonical
        births = make_births(start.state, 2, frame) if frame % 3 else None
        states.append(commit(moved_frame, births))
    loop.finish()
    return sink.getvalue(), [compute_digest(state.scene) for state in states]


_DATA, _DIGESTS = _make_stream()
_CHUNKS = list(split_chunks(_DATA))


def _compute_digests(data: bytes, start: int = 0, stop: int | None = None) -> list[str]:
    return [compute_digest(scene) for scene in decode(data, start, stop)]


def test_a_stream_with_snapshots_decodes_as_written():
    assert [c.kind for c in _CHUNKS].count(container.SNAP) == len(_SNAPSHOTS)
    assert _compute_digests(_DATA) == _DIGESTS


@pytest.mark.parametrize("frame", range(_FRAMES))
@pytest.mark.parametrize("indexed", [True, False])
def test_every_frame_is_reached_through_one_canonical_frame_and_one_snapshot(frame, indexed):
    source = CountedSource(_DATA if indexed else _DATA[: _CHUNKS[-2].offset])

    scene = next(iter(decode(source, frame, frame + 1)))

    assert compute_digest(scene) == _DIGESTS[frame]
    read_types = {
        chunk.kind
        for chunk in _CHUNKS
        if chunk.kind in (container.CANO, container.SNAP)
        and any(begin <= chunk.offset + 40 < begin + size for begin, size in source.reads)
    }
    seek_point = max(item for item in (0, _CANONICAL, *_SNAPSHOTS) if item <= frame)
    assert (container.SNAP in read_types) == (seek_point in _SNAPSHOTS)


@pytest.mark.parametrize("start", [0, _CANONICAL, *_SNAPSHOTS])
@pytest.mark.parametrize("stop", [7, 12, None])
def test_a_cut_can_start_at_a_snapshot_and_keeps_every_digest(start, stop):
    if stop is not None and stop <= start:
        return

    cut_stream = cut_bytes(_DATA, start, stop)

    assert _compute_digests(cut_stream) == _DIGESTS[start:stop]
    assert (
        next(c.kind for c in split_chunks(cut_stream) if c.kind in container.FRAME_TYPES)
        == container.CANO
    )


def test_later_snapshots_of_a_cut_stay_snapshots():
    kinds = [chunk.kind for chunk in split_chunks(cut_bytes(_DATA, 3, None))]

    assert kinds.count(container.SNAP) == 2


@pytest.mark.parametrize(("kind", "offset"), [(container.CANO, 4), (container.SNAP, 8)])
def test_a_cut_does_not_exceed_the_gaussians_of_its_level(kind, offset):
    type_and_payload = [(chunk.kind, bytearray(chunk.payload)) for chunk in _CHUNKS]
    payload = next(payload for item, payload in type_and_payload if item == kind)
    payload[offset : offset + 4] = b"\xff" * 4  # gaussian_count, newborn_count

    with pytest.raises(CountLevelError):
        cut_bytes(rebuild_stream([(item, bytes(data)) for item, data in type_and_payload]), 3, None)


def test_parts_join_to_the_whole():
    parts = [cut_bytes(_DATA, 0, 6), cut_bytes(_DATA, 6, None)]

    assert _compute_digests(join_bytes(*parts)) == _DIGESTS


@pytest.mark.parametrize("number", range(3, len(_CHUNKS) - 2))
def test_after_damage_decoding_resumes_at_a_snapshot_with_its_canonical_frame(number):
    damaged_data = bytearray(_DATA)
    damaged_data[_CHUNKS[number].offset + 25] ^= 1

    scenes = [item for item in recover(bytes(damaged_data)) if not isinstance(item, Gap)]

    lost_frame = number - 3
    resume_frame = next((f for f in sorted((*_SNAPSHOTS, _CANONICAL)) if f > lost_frame), _FRAMES)
    if lost_frame in (0, _CANONICAL):  # snapshots cannot be decoded without their CANO
        resume_frame = _CANONICAL if lost_frame == 0 else _FRAMES
    assert [scene.frame for scene in scenes] == [*range(lost_frame), *range(resume_frame, _FRAMES)]
    assert all(compute_digest(scene) == _DIGESTS[scene.frame] for scene in scenes)


def test_snapshots_need_a_header_that_allows_them():
    loop = ClosedLoop(io.BytesIO(), replace(_HEADER, snapshots=False), (CAMERA,), {})
    loop.commit_canonical(make_gaussians(_HEADER, 9), 0)
    start = loop.start_frame(0)
    moved_frame = loop.move_frame(start, make_symbols(start.state))

    with pytest.raises(ValueError, match="does not allow snapshots"):
        loop.commit_as_snapshot(moved_frame, None)


def test_an_encode_with_snapshots_resumes_to_the_same_bytes(tmp_path):
    canonical = replace(SMALL.canonical, iterations=30, keyframe_interval=4, snapshot_interval=2)
    options = EncodeOptions(replace(SMALL, canonical=canonical), 7, "cpu")
    encode_file(make_capture(7), tmp_path / "a.quarc", options)
    complete_stream = (tmp_path / "a.quarc").read_bytes()
    chunks = [
        chunk for chunk in split_chunks(complete_stream) if chunk.kind in container.FRAME_TYPES
    ]

    assert [chunk.kind.decode() for chunk in chunks] == [
        *("CANO", "FRAM", "SNAP", "FRAM", "CANO", "FRAM", "SNAP")
    ]
    for index in (3, 6):
        (tmp_path / "a.quarc").write_bytes(complete_stream[: chunks[index].offset + 9])
        encode_file(make_capture(7), tmp_path / "a.quarc", options)
        assert (tmp_path / "a.quarc").read_bytes() == complete_stream


def test_snapshots_are_declared_in_the_header_on_request():
    default_header = make_header(SMALL, 30.0, 9)
    config = replace(SMALL, canonical=replace(SMALL.canonical, snapshot_interval=30))

    assert (default_header.snapshots, make_header(config, 30.0, 9).snapshots) == (False, True)


def test_the_kind_of_a_frame_is_given_once():
    settings = CanonicalSettings(keyframe_interval=6, snapshot_interval=2)

    kinds = [settings.frame_kind(frame) for frame in range(8)]

    assert np.array(kinds).tolist() == [
        *(b"CANO", b"FRAM", b"SNAP", b"FRAM", b"SNAP", b"FRAM", b"CANO", b"FRAM")
    ]


@pytest.mark.parametrize("dead_zone", [0, 1000])
def test_an_encode_undoes_moves_within_the_dead_zone_of_its_settings(dead_zone):
    canonical = replace(
        SMALL.canonical, iterations=30, snapshot_interval=2, snapshot_dead_zone=dead_zone
    )
    sink = io.BytesIO()
    encode(make_capture(3), sink, EncodeOptions(replace(SMALL, canonical=canonical), 3, "cpu"))

    chunks = {chunk.kind: chunk.payload for chunk in split_chunks(sink.getvalue())}
    code_planes = wire.parse_stream_header(chunks[container.HEAD]).code_planes
    canonical_gaussians = read_canonical(wire.parse_canonical(chunks[container.CANO]), code_planes)
    snapshot = read_snapshot(wire.parse_snapshot(chunks[container.SNAP]), canonical_gaussians)

    moves = compute_differences(snapshot, canonical_gaussians)[SURVIVOR_FIELDS["position"]]
    assert moves.any() == (dead_zone == 0)
