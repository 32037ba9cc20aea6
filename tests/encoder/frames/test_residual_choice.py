import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quarc_ref.encoder.frames.residual_choice import choose_residuals
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.update_planes import UpdateContext, write_updates
from quarc_ref.format.constants import RESIDUAL_ROWS
from quarc_ref.format.updates import Updates

_GAUSSIAN_COUNT = 2000
_TRANSLATION_X, _OPACITY = 0, 9


def _choose(residuals, gradients_at_zero, rd_lambda):
    """Choose residuals that training has fully converged to: the gradients there are 0."""
    gradients = np.zeros(residuals.shape)
    return choose_residuals(residuals, gradients, gradients_at_zero, _GAUSSIAN_COUNT, rd_lambda)


def _make_residuals(count=300):
    generator = np.random.default_rng(0)
    residuals = np.rint(generator.laplace(scale=0.7, size=(RESIDUAL_ROWS, count)))
    residuals[_OPACITY] += 1
    return residuals.astype(np.int64)


def _count_bytes(residuals):
    rows = np.flatnonzero(np.any(residuals, axis=0))
    updates = Updates(rows, np.zeros(rows.size, dtype=np.bool_), residuals[:, rows])
    context = UpdateContext(
        np.zeros((6, _GAUSSIAN_COUNT), np.int16), np.zeros(_GAUSSIAN_COUNT, np.int16)
    )
    return write_updates(context, updates, ContextCounts()).byte_count()


@given(
    residuals=arrays(np.int64, (RESIDUAL_ROWS, 8), elements=st.integers(-9, 9)),
    gradients=arrays(np.float64, (2, RESIDUAL_ROWS, 8), elements=st.floats(-9, 9)),
    rd_lambda=st.floats(1e-6, 10),
)
def test_no_residual_grows_or_changes_its_sign(residuals, gradients, rd_lambda):
    chosen = choose_residuals(residuals, *gradients, _GAUSSIAN_COUNT, rd_lambda)

    assert np.all(np.abs(chosen) <= np.abs(residuals))
    assert np.all(chosen * residuals >= 0)


def test_residuals_that_gain_nothing_are_cleared():
    residuals = _make_residuals()
    gradients_at_zero = -100.0 * residuals
    gradients_at_zero[_TRANSLATION_X] = 0

    chosen = _choose(residuals, gradients_at_zero, 0.01)

    assert not chosen[_TRANSLATION_X].any()
    assert np.array_equal(chosen[1:], residuals[1:])


def test_a_small_residual_goes_before_a_large_one():
    residuals = np.zeros((RESIDUAL_ROWS, 40), np.int64)
    residuals[_TRANSLATION_X] = np.arange(40) % 2 * 5 + 1  # 1, 6, 1, 6, ...

    chosen = _choose(residuals, -1.0 * residuals, 0.3)

    assert chosen[_TRANSLATION_X].tolist() == 20 * [0, 6]


def test_the_loss_of_residuals_that_act_together_is_shared():
    """The loss is (sum of n equal residuals - n)^2 / 2: without one, 1/2; without all, n^2 / 2."""
    count = 50
    residuals = np.zeros((RESIDUAL_ROWS, count), np.int64)
    residuals[_OPACITY] = 1
    gradients_at_zero = np.zeros(residuals.shape)
    gradients_at_zero[_OPACITY] = -count

    assert np.array_equal(_choose(residuals, gradients_at_zero, 1.0), residuals)


def test_a_higher_lambda_gives_fewer_bytes():
    residuals = _make_residuals()

    sizes = [
        _count_bytes(_choose(residuals, -1.0 * residuals, rd_lambda))
        for rd_lambda in (1e-9, 0.1, 0.2, 0.4, 10.0)
    ]

    assert sizes[0] == _count_bytes(residuals)
    assert sizes[0] > sizes[1] > sizes[2] > 2 * sizes[3]
    assert sizes[4] == _count_bytes(np.zeros_like(residuals))


def test_without_residuals_there_is_nothing_to_choose():
    empty = np.zeros((RESIDUAL_ROWS, 0), np.int64)

    assert _choose(empty, np.zeros(empty.shape), 1.0).shape == empty.shape
