"""Chooses the residuals of updates by rate and distortion (RDOQ).

The rate term of training only approximates the bits of a residual, so many trained residuals lower
the loss by less than their bits are worth. A residual is therefore reduced, or set to 0, if this
saves enough bits. The codes of frame 0 are chosen similarly (`training.rdoq`).

Residuals of overlapping Gaussians act together: setting one of them to 0 hardly changes the loss,
but setting all of them to 0 does. The loss is therefore modeled on the line from zero residuals to
the trained ones, where it is assumed to be quadratic. Its gradients at both ends determine how much
of the decrease of the loss is due to each residual.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from quarc_ref.encoder.rotations import Float64
from quarc_ref.encoder.training.code_rates import CodeRates
from quarc_ref.encoder.training.minimize_costs import minimize_costs
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import RESIDUAL_ROWS
from quarc_ref.format.updates import UPDATE_FIELDS

_COUNT_OFFSET = 0.5  # rare events take many bits, but not infinitely many


def choose_residuals(
    residuals: Int64,
    gradients: Float64,
    gradients_at_zero: Float64,
    gaussian_count: int,
    rd_lambda: float,
) -> Int64:
    """Return residuals `[RESIDUAL_ROWS, u]` that minimize loss plus weighted rate.

    No residual becomes larger or changes its sign.

    Args:
        residuals: `[RESIDUAL_ROWS, u]` trained residuals, which are not all 0 for any Gaussian.
        gradients: `[RESIDUAL_ROWS, u]` gradients of the loss by these residuals.
        gradients_at_zero: `[RESIDUAL_ROWS, u]` gradients if all residuals are 0.
        gaussian_count: Number of Gaussians in the frame, including those without an update.
        rd_lambda: Increase of the loss that is worth a bit.
    """
    curvatures = np.divide(
        gradients - gradients_at_zero,
        residuals,
        out=np.zeros_like(gradients),
        where=residuals != 0,
    ).clip(0)

    def measure_distortions(reduced: Int64) -> Float64:
        changes = reduced - residuals
        distortions: Float64 = ((gradients + 0.5 * curvatures * changes) * changes).sum(axis=0)
        return distortions

    def fit_rates(codes: Int64) -> Callable[[Int64], Float64]:
        return _ResidualRates(codes, gaussian_count).bits

    return minimize_costs(residuals, _list_moves(), measure_distortions, fit_rates, rd_lambda)


def _list_moves() -> list[Callable[[Int64], Int64]]:
    """Return functions that reduce or clear a row, clear a field, or clear all residuals."""
    rows = [slice(row, row + 1) for row in range(RESIDUAL_ROWS)]
    moves = [partial(move, rows=row) for row in rows for move in (_reduce, _clear)]
    moves += [partial(_clear, rows=field) for field in UPDATE_FIELDS.values()]
    return [*moves, partial(_clear, rows=slice(RESIDUAL_ROWS))]


def _reduce(residuals: Int64, rows: slice) -> Int64:
    reduced = residuals.copy()
    reduced[rows] -= np.sign(residuals[rows])
    return reduced


def _clear(residuals: Int64, rows: slice) -> Int64:
    cleared = residuals.copy()
    cleared[rows] = 0
    return cleared


class _ResidualRates:
    """The bits of a Gaussian's residuals, estimated from the residuals of all Gaussians.

    The bits are those of the planes in SPEC 8.8: whether a Gaussian changes, which of its fields
    change, and the residuals of these fields.

    Args:
        residuals: `[RESIDUAL_ROWS, u]` residuals.
        gaussian_count: Number of Gaussians in the frame.
    """

    def __init__(self, residuals: Int64, gaussian_count: int) -> None:
        changed = residuals[:, np.any(residuals, axis=0)]
        changed_count = changed.shape[1]
        bits_unchanged, bits_changed = _measure_bits(changed_count, gaussian_count)
        self._change_bits = bits_changed - bits_unchanged
        self._fields = []
        for rows in UPDATE_FIELDS.values():
            has_field = np.any(changed[rows], axis=0)
            flag_bits = _measure_bits(int(has_field.sum()), changed_count)
            rates = CodeRates(changed[rows][:, has_field]) if has_field.any() else None
            self._fields.append((rows, flag_bits, rates))

    def bits(self, residuals: Int64) -> Float64:
        """Return the `[u]` bits of other residuals, relative to Gaussians without an update."""
        bits = np.full(residuals.shape[1], self._change_bits)
        for rows, (bits_without, bits_with), rates in self._fields:
            field = residuals[rows]
            has_field = np.any(field, axis=0)
            bits += np.where(has_field, bits_with, bits_without)
            if rates is not None:
                bits[has_field] += rates.bits(field[:, has_field])
        return np.where(np.any(residuals, axis=0), bits, 0.0)


def _measure_bits(count: int, total: int) -> tuple[float, float]:
    """Return the bits of "no" and of "yes", if `count` of `total` answers are "yes"."""
    occurrences = np.array([total - count, count]) + _COUNT_OFFSET
    bits_no, bits_yes = -np.log2(occurrences / occurrences.sum())
    return float(bits_no), float(bits_yes)
