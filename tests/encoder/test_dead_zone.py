"""Snapshots undo small moves since the canonical frame, and leave all other values unchanged."""

import io
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.encoder.dead_zone import undo_small_moves
from quarc_ref.format.records import Gaussians, StreamHeader
from quarc_ref.format.updates import TRANSLATION, Updates
from tests.small_streams import CAMERA, make_gaussians, make_symbols

# Two translation steps are 14 lattice units, or 3.5 position steps, which round to 4.
_HEADER = StreamHeader(
    position_step=4,
    translation_step=7,
    gaussians_per_anchor=4,
    updates=True,
    snapshots=True,
)
_COUNT = 40
_CANONICAL = make_gaussians(_HEADER, _COUNT)
_ROOTS = np.arange(_COUNT)


def _change_row(row: int, offset: int, part: str = "positions") -> Gaussians:
    rows = getattr(_CANONICAL, part).copy()
    rows[row] += offset
    return replace(_CANONICAL, **{part: rows})


def _are_equal(first: Gaussians, second: Gaussians) -> bool:
    parts = ("positions", "rotations", "codes")
    return all(np.array_equal(getattr(first, part), getattr(second, part)) for part in parts)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(("offset", "is_undone"), [(4, True), (-4, True), (5, False), (-5, False)])
def test_a_position_within_the_dead_zone_returns_to_the_canonical_one(axis, offset, is_undone):
    changed = _change_row(axis, offset)

    result = undo_small_moves(changed, _CANONICAL, _ROOTS, _HEADER, 2)

    assert _are_equal(result, _CANONICAL if is_undone else changed)


@pytest.mark.parametrize("component", [1, 2, 3])
@pytest.mark.parametrize(("offset", "is_undone"), [(2, True), (-2, True), (3, False), (-3, False)])
def test_a_rotation_within_the_dead_zone_returns_to_the_canonical_one(component, offset, is_undone):
    changed = _change_row(component, offset, "rotations")

    result = undo_small_moves(changed, _CANONICAL, _ROOTS, _HEADER, 2)

    assert _are_equal(result, _CANONICAL if is_undone else changed)


def test_a_rotation_with_another_largest_component_is_kept():
    changed = _change_row(0, 1, "rotations")

    assert _are_equal(undo_small_moves(changed, _CANONICAL, _ROOTS, _HEADER, 2), changed)


def test_codes_have_no_dead_zone():
    changed = _change_row(3, 1, "codes")

    assert _are_equal(undo_small_moves(changed, _CANONICAL, _ROOTS, _HEADER, 2), changed)


def test_a_gaussian_that_moves_far_on_one_axis_keeps_the_others_too():
    changed = _change_row(0, 9)
    changed.positions[1] += 1

    assert _are_equal(undo_small_moves(changed, _CANONICAL, _ROOTS, _HEADER, 2), changed)


def test_new_gaussians_and_another_order_are_respected():
    changed = _change_row(0, 1)
    reversed_roots = _ROOTS[::-1].copy()
    backwards = Gaussians(
        changed.positions[:, ::-1], changed.rotations[:, ::-1], changed.codes[:, ::-1]
    )
    reversed_roots[0] = -1

    result = undo_small_moves(backwards, _CANONICAL, reversed_roots, _HEADER, 2)

    assert np.array_equal(result.positions[:, 1:], _CANONICAL.positions[:, -2::-1])
    assert np.array_equal(result.positions[:, 0], changed.positions[:, -1])


def test_a_dead_zone_of_0_keeps_every_move():
    changed = _change_row(1, 1)

    assert _are_equal(undo_small_moves(changed, _CANONICAL, _ROOTS, _HEADER, 0), changed)


def test_a_snapshot_with_a_dead_zone_is_smaller_and_decodes_to_the_canonical_positions():
    sizes = {}
    for dead_zone in (0, 2):
        loop = ClosedLoop(io.BytesIO(), _HEADER, (CAMERA,), {})
        first_state = loop.commit_canonical(_CANONICAL, 0)
        start = loop.start_frame(0)
        symbols = [0 * level for level in make_symbols(start.state)]
        residuals = np.zeros((13, _COUNT), dtype=np.int64)
        residuals[TRANSLATION] = np.random.default_rng(0).integers(-2, 3, (3, _COUNT))
        updates = Updates(_ROOTS, np.zeros(_COUNT, dtype=np.bool_), residuals)
        moved_frame = loop.move_frame(start, symbols, updates)
        last_state = loop.commit_as_snapshot(moved_frame, None, dead_zone)
        sizes[dead_zone] = loop.frame_bytes
        is_unchanged = np.array_equal(last_state.scene.positions, first_state.scene.positions)
        assert is_unchanged == (dead_zone == 2)

    assert sizes[2] < sizes[0]
