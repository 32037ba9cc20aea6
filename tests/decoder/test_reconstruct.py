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


def _begun(header=_HEADER, count=30, deaths=0):
    return begin_frame(begin_canonical(header, 0, make_gaussians(header, count)), deaths)


@given(st.integers(0, 1000), st.sampled_from([3, 4]))
def test_motion_matches_plain_integers(seed, components):
    header = replace(_HEADER, rotation_components=components)
    started = _begun(header)
    symbols = make_symbols(started, seed)

    moved = move(started, symbols)

    for i in range(started.scene.count):
        followed = zip(symbols, started.known_anchors.binding, strict=True)
        sums = [
            sum(s) for s in zip(*[level[:, b[i]].tolist() for level, b in followed], strict=True)
        ]
        position = [
            int(p) + header.translation_step * s
            for p, s in zip(started.scene.positions[:, i], sums, strict=False)
        ]
        w = header.rotation_unity * header.level_count + (sums[3] if components == 4 else 0)
        rotation = started.scene.rotations[:, i].tolist()
        expected = oracle.rotate(rotation, [w, *sums[-3:]]) if any(sums[3:]) else rotation
        assert moved.scene.positions[:, i].tolist() == position
        assert moved.scene.rotations[:, i].tolist() == expected
        assert moved.motion[:, i].tolist() == sums


def test_a_sum_of_zero_keeps_a_rotation_to_the_bit():
    started = _begun()
    still = [np.zeros_like(level) for level in make_symbols(started)]

    moved = move(started, still)

    assert np.array_equal(moved.scene.rotations, started.scene.rotations)


def test_a_w_that_cancels_the_identity_is_rejected():
    header = replace(_HEADER, rotation_components=4, rotation_unity=10, level_count=1)
    started = _begun(header)
    symbols = [
        np.zeros((7, level.owners.size), dtype=int) for level in started.known_anchors.levels
    ]
    symbols[0][3] = -10

    with pytest.raises(DegenerateRotationError):
        move(started, symbols)


def test_a_gaussian_that_leaves_the_lattice_is_rejected():
    started = _begun(replace(_HEADER, translation_step=60_000))
    symbols = [np.full((6, level.owners.size), 65) for level in started.known_anchors.levels]

    with pytest.raises(PositionRangeError):
        move(started, symbols)


def test_the_dead_are_those_of_lowest_opacity_and_then_of_lowest_id():
    state = begin_canonical(_HEADER, 0, make_gaussians(_HEADER, 30))
    codes = state.scene.codes.copy()
    codes[3] = [5, -7, 5, -7, *range(10, 36)]
    state = replace(state, scene=replace(state.scene, codes=codes))

    started = begin_frame(state, 3)

    assert started.scene.ids.tolist() == [2, *range(4, 30)]


@pytest.mark.parametrize("deaths", [30, 31, 1 << 32])
def test_the_last_gaussian_cannot_die(deaths):
    with pytest.raises(CountError):
        _begun(deaths=deaths)


def test_births_without_a_free_id_are_rejected():
    moved = move(_begun(), make_symbols(_begun()))
    births = make_births(moved, 4)

    last = append_births(replace(moved, next_id=(1 << 32) - 4), births)

    assert last.scene.ids[-1] == (1 << 32) - 1
    with pytest.raises(CountLevelError):
        append_births(replace(moved, next_id=(1 << 32) - 3), births)


def test_births_follow_anchors_from_the_next_frame_and_bound_gaussians_keep_theirs():
    moved = move(_begun(), make_symbols(_begun()))
    grown = append_births(moved, make_births(moved, 4))

    following = begin_frame(grown, 0)

    before, after = moved.known_anchors.binding, following.known_anchors.binding
    levels = [level.positions.T.tolist() for level in following.known_anchors.levels]
    newborn = [tuple(p) for p in grown.scene.positions.T[30:].tolist()]
    assert after[:, :30].tolist() == before.tolist()
    assert after[:, 30:].tolist() == [oracle.bind(newborn, level) for level in levels]


def test_anchors_are_sampled_again_after_the_interval_and_not_before():
    state = _begun()
    drawn = [state.known_anchors.levels]
    for _ in range(3):
        state = begin_frame(move(state, make_symbols(state)), 0)
        drawn.append(state.known_anchors.levels)

    assert [later is earlier for earlier, later in pairwise(drawn)] == [
        True,
        False,
        True,
    ]


def test_a_dead_newborn_does_not_change_the_binding_of_others():
    moved = move(_begun(), make_symbols(_begun()))
    births = make_births(moved, 4)
    lowered = births.newborn.codes.copy()
    lowered[3, 1] -= 500
    births = replace(births, newborn=replace(births.newborn, codes=lowered))
    grown = append_births(moved, births)

    following = begin_frame(grown, 1)

    assert following.scene.ids.tolist() == [*range(30), 30, 32, 33]
    assert following.known_anchors.binding.shape == (3, 33)


def test_a_newborn_is_placed_by_its_parent_and_has_its_own_codes():
    moved = move(_begun(), make_symbols(_begun()))
    births = make_births(moved, 5)

    grown = append_births(moved, births).scene

    parents = births.parents
    assert grown.ids.tolist() == list(range(35))
    assert (grown.positions[:, 30:] - moved.scene.positions[:, parents]).tolist() == (
        births.newborn.positions * _HEADER.position_step
    ).tolist()
    assert grown.codes[:, 30:].tolist() == births.newborn.codes.tolist()
    assert grown.rotations[:, 30:].T.tolist() == [
        oracle.expand_rotation(c[0], c[1:], _HEADER.rotation_bits)
        for c in births.newborn.rotations.T.tolist()
    ]


def _changed(births, **fields):
    return replace(births, newborn=replace(births.newborn, **fields))


def test_births_out_of_range_are_rejected_by_name():
    moved = move(_begun(), make_symbols(_begun()))
    births = make_births(moved, 2)
    far = np.full((3, 2), POSITION_LIMIT)

    with pytest.raises(ParentRangeError):
        append_births(moved, replace(births, parents=np.array([0, 30])))
    with pytest.raises(PositionRangeError):
        append_births(moved, _changed(births, positions=far))
    with pytest.raises(CodeRangeError):
        append_births(
            moved, _changed(births, codes=np.full_like(births.newborn.codes, 2 * CODE_LIMIT))
        )


def test_more_gaussians_than_the_level_allows_are_rejected(monkeypatch):
    moved = move(_begun(), make_symbols(_begun()))
    small = _HEADER.limits._replace(gaussians=31)
    monkeypatch.setitem(__import__("quarc_ref").format.records.LEVELS, 10, small)

    with pytest.raises(CountLevelError):
        append_births(moved, make_births(moved, 2))


def test_a_canonical_position_off_the_lattice_is_rejected():
    header = replace(_HEADER, position_step=16)
    made = make_gaussians(header, 5)

    with pytest.raises(PositionRangeError):
        begin_canonical(
            header, 0, Gaussians(made.positions + POSITION_LIMIT, made.rotations, made.codes)
        )


def test_contexts_reflect_what_the_gaussian_of_each_anchor_did():
    started = _begun()
    moved = move(started, make_symbols(started))
    following = begin_frame(moved, 0)

    contexts = motion_contexts(following, previous=True)

    for context, level in zip(contexts, following.known_anchors.levels, strict=True):
        assert context.previous.tolist() == moved.motion[:, level.owners].tolist()
    assert not any(c.previous.any() for c in motion_contexts(following, previous=False))


def test_an_anchor_whose_gaussian_died_has_no_last_motion():
    started = _begun()
    moved = move(started, [np.ones_like(level) for level in make_symbols(started)])
    dead = begin_frame(moved, 29)

    contexts = motion_contexts(dead, previous=True)

    for context, level in zip(contexts, dead.known_anchors.levels, strict=True):
        alive = np.isin(level.owners, dead.scene.ids)
        assert context.previous.any(axis=0).tolist() == alive.tolist()
