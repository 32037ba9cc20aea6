"""Whole frames by compiled kernels against the same by NumPy."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.reconstruct import (
    bear,
    begin_canonical,
    begin_frame,
    choose_deaths,
    motion_contexts,
    move,
)
from quarc_ref.decoder.rotation import normalize_sums, turn
from quarc_ref.decoder.updates import update
from quarc_ref.format.acceleration import COMPILED, PLAIN, computing_with, threading_by
from quarc_ref.format.constants import POSITION_LIMIT
from quarc_ref.format.errors import DegenerateRotationError, PositionRangeError
from tests import strategies
from tests.streams import make_births, make_gaussians, make_symbols, make_updates

pytest.importorskip("numba")


def _run(header, count, seed, kernels, threads=1, room=0):
    """Three frames with motion, births and deaths; all that could differ."""
    shown = []
    with computing_with(kernels), threading_by(threads):
        state = begin_canonical(header, 0, make_gaussians(header, count, seed))
        for frame in range(1, 4):
            begun = begin_frame(state, min(3, count - 1), room, meanwhile=frame > 1)
            contexts = motion_contexts(begun, previous=True)
            moved = move(begun, make_symbols(begun, seed + frame))
            if header.updates:
                spare = state.scene if frame == 2 else None
                moved = update(moved, make_updates(moved, seed + frame), spare)
            state = bear(moved, make_births(moved, 4, seed + frame))
            shown += [context.previous.tolist() for context in contexts]
            shown += [state.motion.tolist(), begun.known_anchors.binding.tolist()]
            shown.append(compute_digest(state.scene))
    return shown


@settings(max_examples=30)
@given(
    strategies.headers(),
    st.integers(1, 60),
    st.integers(0, 1 << 30),
    st.sampled_from([1, 3]),
    st.sampled_from([0, 4]),
)
def test_frames_by_compiled_kernels_are_those_of_numpy(header, count, seed, threads, room):
    header = replace(header, position_step=1, rotation_unity=max(header.rotation_unity, 40))

    compiled = _run(header, count, seed, COMPILED, threads, room)

    assert compiled == _run(header, count, seed, PLAIN, room=4 - room)


def test_newborn_in_the_room_behind_planes_leave_what_was_before_them():
    header = strategies.StreamHeader()
    with computing_with(COMPILED):
        begun = begin_frame(begin_canonical(header, 0, make_gaussians(header, 20)), 3, 4)
        moved = move(begun, make_symbols(begun))
        before = [compute_digest(state.scene) for state in (begun, moved)]
        grown = bear(moved, make_births(moved, 4))

    assert [compute_digest(state.scene) for state in (begun, moved)] == before
    assert np.shares_memory(grown.scene.codes, begun.scene.codes)
    assert np.shares_memory(grown.scene.positions, moved.scene.positions)


@given(st.lists(st.integers(-4, 4), min_size=1, max_size=40), st.data())
def test_the_dead_are_the_same(opacities, data):
    header = strategies.StreamHeader()
    scene = begin_canonical(header, 0, make_gaussians(header, len(opacities))).scene
    codes = scene.codes.copy()
    codes[3] = opacities
    scene = replace(scene, codes=codes)
    count = data.draw(st.integers(0, len(opacities)))

    with computing_with(PLAIN):
        expected = np.sort(choose_deaths(scene, count))
    with computing_with(COMPILED):
        assert np.sort(choose_deaths(scene, count)).tolist() == expected.tolist()


_MOST = (1 << 10) - 1
_SUM = st.one_of(st.integers(-_MOST, _MOST), st.sampled_from([-_MOST, 0, 1, _MOST]))
_TURNS = st.lists(st.tuples(*[_SUM] * 8), min_size=1, max_size=8)


@given(_TURNS.filter(lambda turns: all(any(turn[:4]) and any(turn[4:]) for turn in turns)))
def test_rotations_turned_in_blocks_are_those_of_numpy(turns):
    from quarc_ref.decoder.turning_kernels import BLOCK, make_spare, turn_block

    numbers = np.array(turns)[np.arange(BLOCK) % len(turns)].T
    rotations = normalize_sums(numbers[:4]).astype(np.int32)
    residuals = numbers[4:].astype(np.int32)
    expected = turn(rotations, normalize_sums(numbers[4:]))

    degenerate = turn_block(rotations, residuals, make_spare())

    assert rotations.tolist() == expected.tolist()
    assert not degenerate


def _begun(components=4):
    header = strategies.StreamHeader(rotation_components=components)
    return begin_frame(begin_canonical(header, 0, make_gaussians(header, 20)), 0)


def test_what_leaves_the_lattice_is_refused():
    begun = _begun()
    positions = begun.scene.positions.copy()
    positions[1, 7] = -POSITION_LIMIT
    begun = replace(begun, scene=replace(begun.scene, positions=positions))
    symbols = [-np.ones((7, level.owners.size), int) for level in begun.known_anchors.levels]

    with computing_with(COMPILED), pytest.raises(PositionRangeError):
        move(begun, symbols)


def test_a_sum_that_takes_the_whole_of_a_rotation_away_is_refused():
    begun = _begun()
    unity = begun.scene.header.rotation_unity * begun.scene.header.level_count
    symbols = [np.zeros((7, level.owners.size), int) for level in begun.known_anchors.levels]
    symbols[0][3] = -unity

    with computing_with(COMPILED), pytest.raises(DegenerateRotationError):
        move(begun, symbols)
