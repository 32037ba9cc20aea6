from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plain import oracle
from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.reconstruct import append_births, begin_frame, motion_contexts, move
from quarc_ref.format.constants import CODE_LIMIT, POSITION_LIMIT
from quarc_ref.format.errors import (
    CodeRangeError,
    CountError,
    CountLevelError,
    DegenerateRotationError,
    ParentRangeError,
    PositionRangeError,
)
from quarc_ref.format.records import Gaussians, StreamHeader
from tests.small_streams import make_births, make_gaussians, make_symbols

_HEADER = StreamHeader(gaussians_per_anchor=3, resample_interval=2)


def _begin(header=_HEADER, count=30, deaths=0):
    return begin_frame(begin_canonical(header, 0, make_gaussians(header, count)), deaths)


@given(st.integers(0, 1000), st.sampled_from([3, 4]))
def test_motion_matches_plain_integers(seed, components):
    header = replace(_HEADER, rotation_components=components)
    before_motion = _begin(header)
    symbols = make_symbols(before_motion, seed)

    moved = move(before_motion, symbols)

    for i in range(before_motion.scene.count):
        symbols_and_binding = zip(symbols, before_motion.required_anchors.binding, strict=True)
        sums = [
            sum(s)
            for s in zip(
                *[level[:, b[i]].tolist() for level, b in symbols_and_binding], strict=True
            )
        ]
        position = [
            int(p) + header.translation_step * s
            for p, s in zip(before_motion.scene.positions[:, i], sums, strict=False)
        ]
        w = header.rotation_unity * header.level_count + (sums[3] if components == 4 else 0)
        rotation = before_motion.scene.rotations[:, i].tolist()
        expected = oracle.rotate(rotation, [w, *sums[-3:]]) if any(sums[3:]) else rotation
        assert moved.scene.positions[:, i].tolist() == position
        assert moved.scene.rotations[:, i].tolist() == expected
        assert moved.motion[:, i].tolist() == sums


def test_a_sum_of_zero_keeps_a_rotation_to_the_bit():
    before_motion = _begin()
    zero_symbols = [np.zeros_like(level) for level in make_symbols(before_motion)]

    moved = move(before_motion, zero_symbols)

    assert np.array_equal(moved.scene.rotations, before_motion.scene.rotations)


def test_a_w_that_cancels_the_identity_is_rejected():
    header = replace(_HEADER, rotation_components=4, rotation_unity=10, level_count=1)
    before_motion = _begin(header)
    symbols = [
        np.zeros((7, level.owners.size), dtype=int)
        for level in before_motion.required_anchors.levels
    ]
    symbols[0][3] = -10

    with pytest.raises(DegenerateRotationError):
        move(before_motion, symbols)


def test_a_gaussian_that_leaves_the_lattice_is_rejected():
    before_motion = _begin(replace(_HEADER, translation_step=60_000))
    symbols = [
        np.full((6, level.owners.size), 65) for level in before_motion.required_anchors.levels
    ]

    with pytest.raises(PositionRangeError):
        move(before_motion, symbols)


def test_deaths_have_the_lowest_opacity_and_then_the_lowest_id():
    state = begin_canonical(_HEADER, 0, make_gaussians(_HEADER, 30))
    codes = state.scene.codes.copy()
    codes[3] = [5, -7, 5, -7, *range(10, 36)]
    state = replace(state, scene=replace(state.scene, codes=codes))

    before_motion = begin_frame(state, 3)

    assert before_motion.scene.ids.tolist() == [2, *range(4, 30)]


@pytest.mark.parametrize("deaths", [30, 31, 1 << 32])
def test_the_last_gaussian_cannot_die(deaths):
    with pytest.raises(CountError):
        _begin(deaths=deaths)


def test_births_without_a_free_id_are_rejected():
    moved = move(_begin(), make_symbols(_begin()))
    births = make_births(moved, 4)

    last = append_births(replace(moved, next_id=(1 << 32) - 4), births)

    assert last.scene.ids[-1] == (1 << 32) - 1
    with pytest.raises(CountLevelError):
        append_births(replace(moved, next_id=(1 << 32) - 3), births)


def test_births_are_bound_in_the_next_frame_and_other_gaussians_keep_their_anchors():
    moved = move(_begin(), make_symbols(_begin()))
    with_births = append_births(moved, make_births(moved, 4))

    next_state = begin_frame(with_births, 0)

    binding_before, binding_after = (
        moved.required_anchors.binding,
        next_state.required_anchors.binding,
    )
    levels = [level.positions.T.tolist() for level in next_state.required_anchors.levels]
    newborn = [tuple(p) for p in with_births.scene.positions.T[30:].tolist()]
    assert binding_after[:, :30].tolist() == binding_before.tolist()
    assert binding_after[:, 30:].tolist() == [oracle.bind(newborn, level) for level in levels]


def test_anchors_are_sampled_again_after_the_interval_and_not_before():
    state = _begin()
    levels_by_frame = [state.required_anchors.levels]
    for _ in range(3):
        state = begin_frame(move(state, make_symbols(state)), 0)
        levels_by_frame.append(state.required_anchors.levels)

    assert [later is earlier for earlier, later in pairwise(levels_by_frame)] == [
        True,
        False,
        True,
    ]


def test_a_dead_newborn_does_not_change_the_binding_of_others():
    moved = move(_begin(), make_symbols(_begin()))
    births = make_births(moved, 4)
    lowered = births.newborn.codes.copy()
    lowered[3, 1] -= 500
    births = replace(births, newborn=replace(births.newborn, codes=lowered))
    with_births = append_births(moved, births)

    next_state = begin_frame(with_births, 1)

    assert next_state.scene.ids.tolist() == [*range(30), 30, 32, 33]
    assert next_state.required_anchors.binding.shape == (3, 33)


def test_a_newborn_is_placed_by_its_parent_and_has_its_own_codes():
    moved = move(_begin(), make_symbols(_begin()))
    births = make_births(moved, 5)

    with_births = append_births(moved, births).scene

    parents = births.parents
    assert with_births.ids.tolist() == list(range(35))
    assert (with_births.positions[:, 30:] - moved.scene.positions[:, parents]).tolist() == (
        births.newborn.positions * _HEADER.position_step
    ).tolist()
    assert with_births.codes[:, 30:].tolist() == births.newborn.codes.tolist()
    assert with_births.rotations[:, 30:].T.tolist() == [
        oracle.expand_rotation(c[0], c[1:], _HEADER.rotation_bits)
        for c in births.newborn.rotations.T.tolist()
    ]


def _change_newborn(births, **fields):
    return replace(births, newborn=replace(births.newborn, **fields))


def test_births_out_of_range_are_rejected_by_name():
    moved = move(_begin(), make_symbols(_begin()))
    births = make_births(moved, 2)
    far = np.full((3, 2), POSITION_LIMIT)

    with pytest.raises(ParentRangeError):
        append_births(moved, replace(births, parents=np.array([0, 30])))
    with pytest.raises(PositionRangeError):
        append_births(moved, _change_newborn(births, positions=far))
    with pytest.raises(CodeRangeError):
        append_births(
            moved, _change_newborn(births, codes=np.full_like(births.newborn.codes, 2 * CODE_LIMIT))
        )


def test_a_canonical_position_off_the_lattice_is_rejected():
    header = replace(_HEADER, position_step=16)
    gaussians = make_gaussians(header, 5)

    with pytest.raises(PositionRangeError):
        begin_canonical(
            header,
            0,
            Gaussians(gaussians.positions + POSITION_LIMIT, gaussians.rotations, gaussians.codes),
        )


def test_contexts_contain_the_last_motion_of_each_anchors_gaussian():
    before_motion = _begin()
    moved = move(before_motion, make_symbols(before_motion))
    next_state = begin_frame(moved, 0)

    contexts = motion_contexts(next_state, use_previous=True)

    for context, level in zip(contexts, next_state.required_anchors.levels, strict=True):
        assert context.previous_motion.tolist() == moved.motion[:, level.owners].tolist()
    assert not any(c.previous_motion.any() for c in motion_contexts(next_state, use_previous=False))


def test_an_anchor_whose_gaussian_died_has_no_last_motion():
    before_motion = _begin()
    moved = move(before_motion, [np.ones_like(level) for level in make_symbols(before_motion)])
    after_deaths = begin_frame(moved, 29)

    contexts = motion_contexts(after_deaths, use_previous=True)

    for context, level in zip(contexts, after_deaths.required_anchors.levels, strict=True):
        alive = np.isin(level.owners, after_deaths.scene.ids)
        assert context.previous_motion.any(axis=0).tolist() == alive.tolist()
