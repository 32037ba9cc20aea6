"""Chooses codes that minimize distortion plus weighted rate, as video encoders do (RDOQ)."""

from collections.abc import Callable, Sequence

import numpy as np

from quarc_ref.encoder.rotations import Float64
from quarc_ref.format.arrays import Int64

_ROUNDS = 3  # the rates depend on the codes of all Gaussians, and a code can move several times
_MIN_GAIN = 1e-9  # relative to the cost of a code; smaller gains are caused by rounding

Measure = Callable[[Int64], Float64]  # a number for each Gaussian, given its codes `[k, n]`


def minimize_costs(
    codes: Int64,
    moves: Sequence[Callable[[Int64], Int64]],
    measure_distortions: Measure,
    fit_rates: Callable[[Int64], Measure],
    rd_lambda: float,
) -> Int64:
    """Apply moves to codes; keep each result for the Gaussians whose cost it reduces.

    Args:
        codes: `[k, n]` codes, whose distortion is 0.
        moves: Functions that return other codes for given ones.
        measure_distortions: Returns the `[n]` distortions of codes.
        fit_rates: Returns the function that gives the `[n]` bits of codes, for the frequencies of
            the given codes.
        rd_lambda: Distortion that is worth a bit.
    """
    best = codes.copy()
    distortions = np.zeros(codes.shape[1])
    for _ in range(_ROUNDS):
        count_bits = fit_rates(best)
        costs = distortions + rd_lambda * count_bits(best)
        for move in moves:
            moved = move(best)
            moved_distortions = measure_distortions(moved)
            moved_costs = moved_distortions + rd_lambda * count_bits(moved)
            is_better = moved_costs < costs - _MIN_GAIN * np.abs(costs)
            best[:, is_better] = moved[:, is_better]
            distortions[is_better] = moved_distortions[is_better]
            costs[is_better] = moved_costs[is_better]
    return best
