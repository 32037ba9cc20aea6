import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plain import oracle
from quarc_ref.decoder import binding
from quarc_ref.decoder.anchors import count_anchors, sample_anchors
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.constants import POSITION_LIMIT
from quarc_ref.format.records import StreamHeader

_LIMIT = POSITION_LIMIT


def make_scene(header: StreamHeader, positions: list[tuple[int, int, int]], phase: int) -> Scene:
    count = len(positions)
    return Scene(
        header,
        phase,
        phase,
        np.arange(count) * 3 + 1,
        np.array(positions, dtype=np.int32).T,
        np.zeros((4, count), dtype=np.int32),
        np.zeros((header.code_planes, count), dtype=np.int16),
    )


def clouds(min_size: int = 1) -> st.SearchStrategy:
    """Return a strategy for points: distinct, equal, around 0 and at the ends of the lattice."""
    axes = [
        st.integers(-3, 3),
        st.integers(-1000, 1000),
        st.sampled_from([-_LIMIT, -1, 0, 1, _LIMIT]),
        st.integers(-_LIMIT, _LIMIT),
    ]
    return st.sampled_from(axes).flatmap(
        lambda axis: st.lists(st.tuples(axis, axis, axis), min_size=min_size, max_size=40)
    )


@given(
    clouds(),
    st.integers(0, 1 << 32 - 1),
    st.integers(0, (1 << 64) - 1),
    st.integers(1, 9),
    st.integers(2, 5),
)
def test_anchors_and_binding_match_the_specification(positions, phase, seed, m, ratio):
    header = StreamHeader(seed=seed, gaussians_per_anchor=m, anchor_ratio=ratio)
    scene = make_scene(header, positions, phase)
    counts = count_anchors(scene.count, header)

    anchors = sample_anchors(scene)

    for level, (count, level_anchors, level_binding) in enumerate(
        zip(counts, anchors.levels, anchors.binding, strict=True), start=1
    ):
        ids = scene.ids.tolist()
        expected_indices = oracle.sample(ids, positions, phase, seed, level, count)
        assert level_anchors.owners.tolist() == [ids[index] for index in expected_indices]
        assert level_anchors.positions.T.tolist() == [
            list(positions[index]) for index in expected_indices
        ]
        anchor_positions = [positions[index] for index in expected_indices]
        assert level_binding.tolist() == oracle.bind(positions, anchor_positions)


@given(clouds(), clouds())
def test_newborn_gaussians_follow_the_nearest_anchors(positions, newborn):
    anchors = sample_anchors(make_scene(StreamHeader(gaussians_per_anchor=2), positions, 1))

    extended = anchors.with_births(np.array(newborn, dtype=np.int32).T)

    old_binding = anchors.binding.tolist()
    for level, old, new in zip(anchors.levels, old_binding, extended.binding, strict=True):
        anchor_positions = [tuple(position) for position in level.positions.T.tolist()]
        assert new.tolist() == old + oracle.bind(newborn, anchor_positions)


@pytest.mark.parametrize("step", [0, 16])
def test_births_are_not_compared_with_every_anchor(step, monkeypatch):
    """A stream of a few bytes can have thousands of anchors and, in each frame, of births."""
    positions = [(step * i, 0, 0) for i in range(4096)]
    header = StreamHeader(gaussians_per_anchor=1, level_count=1)
    anchors = sample_anchors(make_scene(header, positions, 1))
    compared = []

    def square_lengths(differences):
        compared.append(differences[0].size)
        return (differences * differences).sum(axis=0)

    monkeypatch.setattr(binding, "_squared_lengths", square_lengths)
    anchors.with_births(np.array(positions, dtype=np.int32).T)

    assert sum(compared) < 100 * len(positions)


@given(clouds(min_size=9))
def test_the_parent_of_an_anchor_is_the_coarser_anchor_that_its_gaussian_follows(positions):
    scene = make_scene(StreamHeader(gaussians_per_anchor=2, anchor_ratio=2), positions, 1)

    anchors = sample_anchors(scene)

    owner_indices = [np.searchsorted(scene.ids, level.owners) for level in anchors.levels]
    assert anchors.levels[0].parents.tolist() == anchors.binding[1][owner_indices[0]].tolist()
    assert anchors.levels[1].parents.tolist() == anchors.binding[2][owner_indices[1]].tolist()
    assert not anchors.levels[2].parents.any()


@pytest.mark.parametrize(
    ("gaussians", "counts"), [(244_000, (61_000, 20_333, 6_777)), (1, (1, 1, 1)), (9, (3, 1, 1))]
)
def test_the_numbers_of_anchors_match_the_specification(gaussians, counts):
    header = StreamHeader(gaussians_per_anchor=4, anchor_ratio=3)

    assert count_anchors(gaussians, header) == counts
