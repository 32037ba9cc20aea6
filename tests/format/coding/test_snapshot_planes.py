from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.coding.gaussian_planes import sort_canonical
from quarc_ref.format.coding.snapshot_planes import (
    CodedSnapshot,
    Snapshot,
    compute_differences,
    read_snapshot,
    write_snapshot,
)
from quarc_ref.format.errors import EntropyError, SymbolRangeError
from quarc_ref.format.records import Gaussians, Section, SnapshotChunk, StreamHeader
from tests import strategies

_HEADER = StreamHeader()


def _chunk(coded: CodedSnapshot) -> SnapshotChunk:
    return SnapshotChunk(
        1,
        0,
        coded.newborn_count,
        coded.origin,
        coded.axis_bits,
        coded.survivors,
        coded.sections,
        0,
    )


def _read(coded: CodedSnapshot, canonical: Gaussians) -> Snapshot:
    return read_snapshot(_chunk(coded), canonical)


def _columns(gaussians: Gaussians) -> list[list[int]]:
    rows = (gaussians.positions, gaussians.rotations, gaussians.codes)
    return sorted(np.concatenate(rows).T.tolist())


def _are_equal(first: Gaussians, second: Gaussians) -> bool:
    names = ("positions", "rotations", "codes")
    return all(np.array_equal(getattr(first, name), getattr(second, name)) for name in names)


@st.composite
def _draw_correspondence(draw):
    """Draw Gaussians of a CANO and of a later frame, and their correspondence."""
    canonical = sort_canonical(draw(strategies.gaussians(_HEADER, draw(st.integers(1, 12)))))[2]
    later = draw(strategies.gaussians(_HEADER, draw(st.integers(1, 15))))
    survivors = sorted(draw(st.sets(st.integers(0, min(canonical.count, later.count) - 1))))
    canonical_indices = np.full(later.count, -1, dtype=np.int64)
    canonical_indices[survivors] = draw(st.permutations(survivors)) if survivors else []
    later.codes[7:, survivors] = canonical.codes[7:, canonical_indices[survivors]]
    return canonical, later, canonical_indices


@given(_draw_correspondence())
def test_a_snapshot_decodes_like_a_canonical_frame(changes):
    canonical, later, canonical_indices = changes

    coded = write_snapshot(canonical, later, canonical_indices)
    decoded = _read(coded, canonical)

    assert _are_equal(decoded.gaussians, coded.gaussians)
    assert sorted(decoded.canonical_indices.tolist()) == sorted(canonical_indices.tolist())
    assert _are_equal(sort_canonical(decoded.gaussians)[2], decoded.gaussians)
    columns = [
        np.concatenate([g.positions, g.rotations, g.codes]).T for g in (decoded.gaussians, later)
    ]
    assert sorted(map(tuple, columns[0].tolist())) == sorted(map(tuple, columns[1].tolist()))


def _scene(count: int = 400) -> Gaussians:
    rng = np.random.default_rng(1)
    rotations = np.concatenate([rng.integers(0, 4, (1, count)), rng.integers(-99, 99, (3, count))])
    gaussians = Gaussians(
        rng.integers(-999, 999, (3, count)), rotations, rng.integers(-60, 60, (16, count))
    )
    return sort_canonical(gaussians)[2]


def test_a_static_scene_costs_almost_nothing():
    scene = _scene()

    coded = write_snapshot(scene, scene, np.arange(scene.count))

    assert coded.survivors.byte_count() < 40
    assert not compute_differences(_read(coded, scene), scene).any()


def test_neighbors_with_similar_motion_cost_little():
    scene, rng = _scene(), np.random.default_rng(2)
    same_motion = replace(scene, positions=scene.positions + np.array([[9], [-7], [4]]))
    random_motion = replace(
        scene, positions=scene.positions + rng.integers(-9, 10, (3, scene.count))
    )

    sizes = [
        write_snapshot(scene, later, np.arange(scene.count)).survivors.byte_count()
        for later in (same_motion, random_motion)
    ]

    assert 4 * sizes[0] < sizes[1]


def test_gaussians_that_changed_too_much_are_coded_as_new():
    scene = _scene(5)
    moved = replace(scene, positions=scene.positions + np.array([[0, 0, 1 << 15, 0, 0]]))
    recolored = replace(scene, codes=scene.codes.copy())
    recolored.codes[9, 3] += 1  # SH rest

    for later in (moved, recolored):
        coded = write_snapshot(scene, later, np.arange(5))
        assert coded.newborn_count == 1
        assert _are_equal(_read(coded, scene).gaussians, coded.gaussians)


def test_a_frame_with_too_large_a_range_is_rejected():
    scene = _scene(3)
    wide_frame = replace(scene, positions=scene.positions + np.array([[0, 0, 1 << 20]]))

    with pytest.raises(SymbolRangeError, match="wider"):
        write_snapshot(scene, wide_frame, np.array([0, 1, -1]))


@given(st.lists(st.integers(0, (1 << 32) - 1), max_size=12))
def test_random_words_give_survivors_or_are_rejected(words):
    scene = _scene(20)
    coded = write_snapshot(scene, scene, np.arange(20))
    chunk = replace(_chunk(coded), survivors=Section(np.array(words, dtype=np.uint32)))

    try:
        snapshot = read_snapshot(chunk, scene)
    except EntropyError:
        return

    assert sorted(set(snapshot.canonical_indices.tolist())) == sorted(
        snapshot.canonical_indices.tolist()
    )
