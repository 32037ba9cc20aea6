import copy
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plain.state import PlainGaussian
from plain.updates import apply_updates as apply_plain_updates
from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.reconstruct import append_births, begin_frame, move
from quarc_ref.decoder.state import State
from quarc_ref.decoder.updates import apply_updates
from quarc_ref.format.constants import CODE_LIMIT, POSITION_LIMIT, RESIDUAL_ROWS
from quarc_ref.format.errors import (
    CodeRangeError,
    CountError,
    PositionRangeError,
    SymbolRangeError,
)
from quarc_ref.format.records import StreamHeader
from quarc_ref.format.updates import Updates
from tests import strategies
from tests.small_streams import make_births, make_gaussians, make_symbols, make_updates

_HEADER = StreamHeader(gaussians_per_anchor=3, resample_interval=3, updates=True)


def _make_moved_state(header: StreamHeader = _HEADER, count: int = 24, seed: int = 0) -> State:
    state = begin_frame(begin_canonical(header, 0, make_gaussians(header, count, seed)), 2)
    return move(state, make_symbols(state, seed))


def _updates(gaussians, rows=(), dies=None) -> Updates:
    """Return updates with the same residuals, pairs `(row, value)`, for all `gaussians`."""
    residuals = np.zeros((RESIDUAL_ROWS, len(gaussians)), dtype=np.int64)
    for row, value in rows:
        residuals[row] = value
    is_deleted = np.zeros(len(gaussians), dtype=np.bool_) if dies is None else np.array(dies)
    return Updates(np.array(gaussians, dtype=np.int64), is_deleted, residuals * ~is_deleted)


def _list_plain_gaussians(state: State) -> list[PlainGaussian]:
    scene = state.scene
    columns = zip(
        *(scene.ids.tolist(), scene.positions.T.tolist(), scene.rotations.T.tolist()),
        *(scene.codes.T.tolist(), state.motion.T.tolist(), state.required_recency.tolist()),
        strict=True,
    )
    return [PlainGaussian(*column) for column in columns]


@given(st.data(), st.integers(0, 100))
def test_updates_match_plain_integers(data, seed):
    moved = _make_moved_state(seed=seed)
    updates = data.draw(strategies.updates(moved.scene.count))
    changes = {
        int(moved.scene.ids[i]): None if dies else row.tolist()
        for i, dies, row in zip(updates.gaussians, updates.dies, updates.residuals.T, strict=True)
    }
    gaussians_before = _list_plain_gaussians(moved)
    step, unity = _HEADER.translation_step, _HEADER.rotation_unity

    updated = apply_updates(moved, updates)

    assert _list_plain_gaussians(updated) == apply_plain_updates(
        copy.deepcopy(gaussians_before), changes, step, unity
    )
    assert _list_plain_gaussians(moved) == gaussians_before  # states are immutable


def test_surviving_gaussians_keep_their_anchors():
    moved = _make_moved_state()
    updates = _updates([1, 4, 9], [(0, 100)], dies=[True, False, True])

    updated = apply_updates(moved, updates)

    survivors = np.delete(np.arange(moved.scene.count), [1, 9])
    assert np.array_equal(
        updated.required_anchors.binding, moved.required_anchors.binding[:, survivors]
    )


def test_a_frame_continues_after_updates_as_after_motion():
    moved = apply_updates(_make_moved_state(), make_updates(_make_moved_state(), 3))
    with_births = append_births(moved, make_births(moved, 3))

    next_state = begin_frame(with_births, 0)

    assert next_state.required_recency.tolist()[-3:] == [0, 0, 0]
    assert (
        next_state.required_anchors.binding.shape[1]
        == next_state.scene.count
        == with_births.scene.count
    )
    assert next_state.motion.shape[1] == next_state.required_recency.size == next_state.scene.count


def test_recency_counts_the_frames_since_the_last_update():
    state, recencies = _make_moved_state(), []
    state = apply_updates(state, _updates([5], [(9, 1)]))
    for _ in range(4):
        recencies.append(int(state.required_recency[5]))
        state = begin_frame(state, 0)
        state = apply_updates(
            move(state, [0 * level for level in make_symbols(state)]), _updates([])
        )

    assert recencies == [0, 1, 2, 3]


def test_all_but_one_gaussian_can_leave_but_not_all():
    count = _make_moved_state().scene.count
    all_deaths = _updates(range(count), dies=[True] * count)

    assert (
        apply_updates(
            _make_moved_state(), _updates(range(1, count), dies=[True] * (count - 1))
        ).scene.count
        == 1
    )
    with pytest.raises(CountError):
        apply_updates(_make_moved_state(), all_deaths)


@pytest.mark.parametrize("sign", [1, -1])
def test_the_limits_of_the_lattice_are_exact(sign):
    header = replace(_HEADER, translation_step=1)
    moved = _make_moved_state(header)
    scene = moved.scene
    positions = scene.positions.copy()
    positions[1, 3] = sign * (POSITION_LIMIT - 5)
    moved = replace(moved, scene=replace(scene, positions=positions))

    at_limit = apply_updates(moved, _updates([3], [(1, 5 * sign)]))

    assert at_limit.scene.positions[1, 3] == sign * POSITION_LIMIT
    with pytest.raises(PositionRangeError):
        apply_updates(moved, _updates([3], [(1, 6 * sign)]))


@pytest.mark.parametrize("row", range(7))
def test_the_limits_of_codes_are_exact(row):
    moved = _make_moved_state()
    margin = CODE_LIMIT - int(moved.scene.codes[row, 2])

    at_limit = apply_updates(moved, _updates([2], [(6 + row, margin)]))

    assert at_limit.scene.codes[row, 2] == CODE_LIMIT
    with pytest.raises(CodeRangeError):
        apply_updates(moved, _updates([2], [(6 + row, margin + 1)]))


def test_a_rotation_beyond_the_limit_is_rejected():
    apply_updates(_make_moved_state(), _updates([2], [(4, -256)]))
    with pytest.raises(SymbolRangeError):
        apply_updates(_make_moved_state(), _updates([2], [(4, -257)]))


def test_a_stream_without_updates_has_no_recency():
    header = replace(_HEADER, updates=False)

    with pytest.raises(ValueError, match="no updates"):
        _ = _make_moved_state(header).required_recency
