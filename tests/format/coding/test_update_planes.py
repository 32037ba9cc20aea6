import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.update_planes import UpdateContext, read_updates, write_updates
from quarc_ref.format.constants import RESIDUAL_ROWS
from quarc_ref.format.errors import EncodeError, EntropyError
from quarc_ref.format.records import Section
from quarc_ref.format.updates import ROTATION, Updates
from tests import strategies

_NEW_COUNTS = ContextCounts()


@st.composite
def _frames(draw):
    count = draw(st.integers(1, 30))
    motion = draw(arrays(np.int16, (6, count), elements=st.integers(-3, 3)))
    recency = draw(arrays(np.int16, count, elements=st.integers(0, 3)))
    return UpdateContext(motion, recency), draw(strategies.updates(count))


def _static_context(count: int) -> UpdateContext:
    return UpdateContext(np.zeros((6, count), dtype=np.int16), np.full(count, 3, dtype=np.int16))


def _updates(gaussians, residuals=None) -> Updates:
    gaussians = np.array(gaussians, dtype=np.int64)
    if residuals is None:
        residuals = np.ones((RESIDUAL_ROWS, gaussians.size), dtype=np.int64)
    return Updates(gaussians, np.zeros(gaussians.size, dtype=np.bool_), residuals)


def _assert_equal(first: Updates, second: Updates) -> None:
    assert first.gaussians.tolist() == second.gaussians.tolist()
    assert first.dies.tolist() == second.dies.tolist()
    assert first.residuals.tolist() == second.residuals.tolist()


@given(_frames())
def test_updates_of_a_frame_survive_a_round_trip(frame):
    context, updates = frame

    decoded, _ = read_updates(write_updates(context, updates, _NEW_COUNTS), context, _NEW_COUNTS)

    _assert_equal(decoded, updates)


@given(_frames())
def test_counts_continue_as_in_the_writer(frame):
    context, updates = frame
    _, counts = read_updates(write_updates(context, updates, _NEW_COUNTS), context, _NEW_COUNTS)

    again, _ = read_updates(write_updates(context, updates, counts), context, counts)

    _assert_equal(again, updates)


def test_a_second_frame_without_updates_costs_nothing():
    _, counts = read_updates(
        write_updates(_static_context(50), _updates([]), _NEW_COUNTS),
        _static_context(50),
        _NEW_COUNTS,
    )

    assert write_updates(_static_context(50), _updates([]), counts).words.size == 0


def test_the_largest_residuals_survive_a_round_trip():
    residuals = np.full((RESIDUAL_ROWS, 2), 32767)
    residuals[ROTATION] = -256
    updates = _updates([0, 2], residuals * [1, -1])

    decoded, _ = read_updates(
        write_updates(_static_context(4), updates, _NEW_COUNTS), _static_context(4), _NEW_COUNTS
    )

    _assert_equal(decoded, updates)


@pytest.mark.parametrize(("row", "value"), [(0, 32768), (12, -32768), (3, 257), (5, -257)])
def test_a_larger_residual_cannot_be_written(row, value):
    residuals = np.zeros((RESIDUAL_ROWS, 1), dtype=np.int64)
    residuals[row] = value

    with pytest.raises(EncodeError, match="exceeds"):
        write_updates(_static_context(3), _updates([1], residuals), _NEW_COUNTS)


def test_recently_changed_gaussians_cost_less():
    rng = np.random.default_rng(0)
    count = 4000
    changed = np.flatnonzero(rng.random(count) < 0.05)
    updates = _updates(changed)
    motion, recency = np.zeros((6, count), dtype=np.int16), np.full(count, 3, dtype=np.int16)
    motion[0, changed], recency[changed] = 1, 0
    static_bytes = write_updates(_static_context(count), updates, _NEW_COUNTS).byte_count()

    assert write_updates(
        UpdateContext(motion, _static_context(count).recency), updates, _NEW_COUNTS
    ).byte_count() < (0.7 * static_bytes)
    assert write_updates(
        UpdateContext(_static_context(count).motion, recency), updates, _NEW_COUNTS
    ).byte_count() < (0.7 * static_bytes)


@given(st.lists(st.integers(0, (1 << 32) - 1), max_size=12), st.integers(1, 40))
def test_random_words_give_updates_or_are_rejected(words, count):
    section = Section(np.array(words, dtype=np.uint32))

    try:
        updates, _ = read_updates(section, _static_context(count), _NEW_COUNTS)
    except EntropyError:
        return

    assert updates.gaussians.tolist() == sorted(set(updates.gaussians.tolist()))
    assert updates.gaussians.size == 0 or updates.gaussians.max() < count
    assert not updates.residuals[:, updates.dies].any()
