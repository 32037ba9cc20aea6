"""The compiled sampler and binding against the plain ones, and against the text's own words."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quarc_ref.decoder import sampling_kernels, tree_kernels
from quarc_ref.decoder.anchors import bind_newborn, count_anchors, sample_anchors
from quarc_ref.decoder.binding import bind_exhaustively
from quarc_ref.format.acceleration import COMPILED, PLAIN, computing_with, threading_by
from quarc_ref.format.constants import POSITION_LIMIT
from quarc_ref.format.records import StreamHeader
from tests import oracle
from tests.decoder.test_anchors import clouds, make_scene

pytest.importorskip("numba")

_HEADERS = st.builds(
    StreamHeader,
    seed=st.integers(0, (1 << 64) - 1),
    gaussians_per_anchor=st.integers(1, 9),
    anchor_ratio=st.integers(2, 5),
)


def _sample(scene, kernels, threads=1):
    with computing_with(kernels), threading_by(threads):
        anchors = sample_anchors(scene)
    anchors.wait()
    return anchors


def _check_alike(scene, threads=1):
    plain, compiled = _sample(scene, PLAIN), _sample(scene, COMPILED, threads)
    assert np.array_equal(plain.binding, compiled.binding)
    assert plain.binding.dtype == compiled.binding.dtype
    for one, other in zip(plain.levels, compiled.levels, strict=True):
        assert np.array_equal(one.owners, other.owners)
        assert np.array_equal(one.positions, other.positions)
        assert np.array_equal(one.parents, other.parents)


@given(clouds(), st.integers(0, (1 << 32) - 1), _HEADERS)
def test_compiled_anchors_and_binding_are_those_of_the_text(positions, phase, header):
    scene = make_scene(header, positions, phase)
    ids = scene.ids.tolist()

    anchors = _sample(scene, COMPILED)

    counts = count_anchors(scene.count, header)
    for number, (count, level) in enumerate(zip(counts, anchors.levels, strict=True), start=1):
        chosen = oracle.sample(ids, positions, phase, header.seed, number, count)
        assert level.owners.tolist() == [ids[index] for index in chosen]
        places = [positions[index] for index in chosen]
        assert anchors.binding[number - 1].tolist() == oracle.bind(positions, places)


def _scattered(rng, count):
    """Dense clusters, lines, and far points between which nearly all anchors lie."""
    kinds = [
        rng.integers(-300, 300, (count, 3)),
        rng.integers(-2, 3, (count, 3)) + 5000,
        rng.integers(-POSITION_LIMIT, POSITION_LIMIT, (count, 3)),
        rng.integers(-40, 40, (count, 3)) * [7, 0, 0],
    ]
    return np.choose(rng.integers(0, 4, (count, 1)), kinds)


@settings(max_examples=15)
@given(st.integers(0, 1 << 32), st.integers(1, 3000), _HEADERS, st.sampled_from([1, 3]))
def test_many_gaussians_are_sampled_and_bound_as_by_numpy(seed, count, header, threads):
    positions = _scattered(np.random.default_rng(seed), count).tolist()

    _check_alike(make_scene(header, positions, 1), threads)


@settings(max_examples=15)
@given(st.integers(0, 1 << 32), st.integers(1, 3000), st.integers(100, 1000))
def test_anchors_that_are_nearly_as_far_across_the_lattice_are_told_apart(seed, count, m):
    rng = np.random.default_rng(seed)
    corners = rng.choice([-1, 1], (count, 3)) * (POSITION_LIMIT - rng.integers(0, 3, (count, 3)))

    _check_alike(make_scene(StreamHeader(gaussians_per_anchor=m), corners.tolist(), 1))


@pytest.mark.parametrize("count", [16, 17, 5000])
def test_all_gaussians_at_one_place_follow_the_first_anchor(count):
    scene = make_scene(StreamHeader(gaussians_per_anchor=2), [(POSITION_LIMIT, 0, -7)] * count, 1)

    assert not _sample(scene, COMPILED).binding.any()
    _check_alike(scene)


def test_a_crowded_place_is_cut_into_runs_that_are_full():
    places = np.zeros((3, 5000), dtype=np.int32)
    places[:, 4000:] = np.arange(1, 1001) * 8
    _, merges = sampling_kernels.sort_cells(places)
    begins = np.arange(merges.size + 1, dtype=np.int32)

    runs = tree_kernels.cut_runs(merges, begins, 64)
    wider = tree_kernels.cut_runs(merges, begins[runs], 256)

    sizes = np.diff(runs)
    assert sizes.max() <= 64
    assert sizes[:62].tolist() == [64] * 62
    assert np.diff(begins[runs][wider])[:15].tolist() == [256] * 15


def test_two_crowded_places_at_both_ends_of_the_lattice():
    ends = [(-POSITION_LIMIT,) * 3, (POSITION_LIMIT,) * 3]

    _check_alike(make_scene(StreamHeader(gaussians_per_anchor=3), ends * 700, 1))


def test_squares_of_distances_that_just_do_not_fit_31_bits_are_held_in_more():
    # About the first two Gaussians there is a box of diagonal 2^29 + 9, squared, which an anchor
    # is as far from: 2^29 + 9 rounds to 2^29 in 24 bits, and so does what reaches that far.
    far = np.array([16145, 16614, 430])
    second = np.array([-1, -1, -1])
    first, last = second - far, second + far
    near = first + np.array([0, 0, 1])
    positions = np.array([first, second, near, *[last] * 64]).tolist()
    header = StreamHeader(seed=0, level_count=1, gaussians_per_anchor=34)
    scene = make_scene(header, positions, 1)

    assert (far @ far) == (1 << 29) + 9
    assert _sample(scene, PLAIN).levels[0].positions.T.tolist() == [near.tolist(), last.tolist()]
    _check_alike(scene)


@given(clouds(), clouds(), _HEADERS)
def test_the_newborn_find_their_anchors_through_the_tree(positions, newborn, header):
    anchors = _sample(make_scene(header, positions, 1), COMPILED)
    places = np.array(newborn, dtype=np.int32).T

    with computing_with(COMPILED):
        bound = [bind_newborn(level, places) for level in anchors.levels]

    for level, answers in zip(anchors.levels, bound, strict=True):
        assert level.tree is not None
        assert np.array_equal(answers, bind_exhaustively(places, level.positions))
