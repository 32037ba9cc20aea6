"""Estimates start times of recordings by correlating their signals.

Two signals are compared at every shift by their normalized cross-correlation, which gives a
curve. The shifts of all cameras are found together, by maximizing the sum of the curves of all
pairs: a pair that agrees by chance at a wrong shift is outvoted by the others.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import fftconvolve

Numbers = NDArray[np.float64]

_MIN_OVERLAP = 12  # minimum overlap of two shifted signals, in samples
_MAX_CORRELATION = 0.999
_SILENCE = 1e-9  # power below which a signal counts as silent
_MAX_SWEEPS = 50


@dataclass(frozen=True, slots=True)
class Shift:
    """Start time of a recording, relative to the others.

    Attributes:
        samples: Sample `t` of the other recordings is sample `t + samples` of this recording.
        confidence: Correlation at this shift minus the highest correlation at other shifts, in
            standard deviations of the correlations at other shifts.
    """

    samples: float
    confidence: float


def align(
    count: int, correlate: Callable[[int, int], Numbers | None], peak_width: int
) -> list[Shift]:
    """Estimate the shift of each signal; the median shift is 0.

    Args:
        count: Number of signals.
        correlate: Function that returns the curve of two signals, as `correlate_signals`
            does, or None if they have nothing in common. All curves have the same length.
        peak_width: Number of samples on either side of a shift that count as the same shift.
    """
    curves = _correlate_all(count, correlate)
    shifts = max(
        (
            _ascend(curves, start)
            for start in (np.zeros(count, np.int64), _find_shifts_greedily(curves))
        ),
        key=lambda found: _sum_pairs(curves, found),
    )
    middle, most = int(np.median(shifts)), curves.shape[2] // 2
    found = []
    for index in range(count):
        curve = _sum_curves(curves, shifts, index, range(count))
        peak = int(shifts[index]) + most
        refined = float(shifts[index] - middle) + _refine(curve, peak)
        found.append(Shift(refined, _measure_clearness(curve, peak, peak_width)))
    return found


def correlate_signals(first: Numbers, second: Numbers, most_shift: int) -> Numbers:
    """Correlate two signals at each shift of the second one.

    Args:
        first: `[T, K]` signal of K values per sample.
        second: `[U, K]` signal of K values per sample.
        most_shift: Largest shift, in samples.

    Returns:
        `[2 * most_shift + 1]` normalized correlation of `first[t]` and `second[t +
        shift]`, as Fisher's z, weighted by the square root of the overlap.
    """
    ones = np.ones((len(first), 1)), np.ones((len(second), 1))
    products = _slide(first, second)
    powers = [
        _slide((first**2).sum(axis=1, keepdims=True), ones[1]),
        _slide(ones[0], (second**2).sum(axis=1, keepdims=True)),
    ]
    overlap = np.rint(_slide(*ones))
    places = np.arange(-most_shift, most_shift + 1) + len(first) - 1
    inside = (places >= 0) & (places < len(products))
    at = places[inside]
    scale = np.sqrt(np.maximum(powers[0][at], 0) * np.maximum(powers[1][at], 0))
    agreement = np.divide(products[at], scale, out=np.zeros(len(at)), where=scale > _SILENCE)
    agreement = np.clip(agreement, -_MAX_CORRELATION, _MAX_CORRELATION)
    weight = np.sqrt(np.maximum(overlap[at] - 3, 0)) * (overlap[at] >= _MIN_OVERLAP)
    curve = np.zeros(2 * most_shift + 1)
    curve[inside] = np.arctanh(agreement) * weight
    return curve


def flatten(levels: Numbers, window: int) -> Numbers:
    """Subtract the running mean from a signal, which removes slow trends.

    Args:
        levels: `[T, K]` signal.
        window: Length of the running mean in samples, odd.
    """
    mean = uniform_filter1d(levels, window, axis=0, mode="nearest")
    return np.asarray(levels - mean, np.float64)


def _slide(first: Numbers, second: Numbers) -> Numbers:
    """Return the sums of products of `first[t]` and `second[t + shift]` at every shift."""
    total: Numbers = fftconvolve(second, first[::-1], axes=0).sum(axis=1)
    return total


def _correlate_all(
    count: int, correlate: Callable[[int, int], Numbers | None]
) -> NDArray[np.float32]:
    """Return `[first, second, shift]` the curves of all pairs."""
    found = {
        (first, second): curve
        for first in range(count)
        for second in range(first + 1, count)
        if (curve := correlate(first, second)) is not None
    }
    length = max(map(len, found.values()), default=1)
    curves = np.zeros((count, count, length), np.float32)
    for (first, second), curve in found.items():
        curves[first, second], curves[second, first] = curve, curve[::-1]
    return curves


def _sum_curves(
    curves: NDArray[np.float32], shifts: NDArray[np.int64], index: int, others: Sequence[int]
) -> Numbers:
    """Return `[shifts]` the agreement of a signal with the others at each shift."""
    width = curves.shape[2]
    total = np.zeros(width)
    for other in others:
        if other != index:
            shift = int(shifts[other])
            source = curves[other, index]
            if shift >= 0:
                total[shift:] += source[: width - shift]
            else:
                total[:shift] += source[-shift:]
    return total


def _find_shifts_greedily(curves: NDArray[np.float32]) -> NDArray[np.int64]:
    """Return shifts that are found signal by signal, in the order of confidence."""
    count, most = len(curves), curves.shape[2] // 2
    shifts = np.zeros(count, np.int64)
    placed = [int(curves.max(axis=2).sum(axis=1).argmax())]
    while len(placed) < count:
        sums = {
            index: _sum_curves(curves, shifts, index, placed)
            for index in range(count)
            if index not in placed
        }
        clearest = max(sums, key=lambda index: float(sums[index].max()))
        shifts[clearest] = int(sums[clearest].argmax()) - most
        placed.append(clearest)
    return shifts


def _ascend(curves: NDArray[np.float32], start: NDArray[np.int64]) -> NDArray[np.int64]:
    """Improve shifts one at a time until no single change increases the sum."""
    shifts, most = start.copy(), curves.shape[2] // 2
    for _ in range(_MAX_SWEEPS):
        before = shifts.copy()
        for index in range(len(shifts)):
            total = _sum_curves(curves, shifts, index, range(len(shifts)))
            shifts[index] = int(total.argmax()) - most
        if (shifts == before).all():
            break
    return shifts


def _sum_pairs(curves: NDArray[np.float32], shifts: NDArray[np.int64]) -> float:
    most = curves.shape[2] // 2
    between = np.clip(shifts[None, :] - shifts[:, None], -most, most) + most
    first, second = np.indices(between.shape)
    return float(curves[first, second, between].sum())


def _refine(curve: Numbers, peak: int) -> float:
    """Return the maximum of a parabola through a peak and its neighbors, relative to the peak."""
    if not 0 < peak < len(curve) - 1:
        return 0.0
    before, top, after = curve[peak - 1 : peak + 2]
    bend = before - 2 * top + after
    return float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5)) if bend < 0 else 0.0


def _measure_clearness(curve: Numbers, peak: int, peak_width: int) -> float:
    others = np.abs(np.arange(len(curve)) - peak) > peak_width
    rest = curve[others]
    spread = float(rest.std()) if rest.size else 0.0
    return float((curve[peak] - rest.max()) / spread) if spread > 0 else 0.0
