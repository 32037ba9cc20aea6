"""Estimates start times of recordings by correlating their signals.

Each pair of signals has a correlation curve: the normalized cross-correlation at every shift. The
shifts of all cameras are estimated together, by maximizing the sum of the correlations of all
pairs. Maximizing the sum limits the influence of two signals that happen to match at a wrong shift.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import fftconvolve

Float64Array = NDArray[np.float64]

_MIN_OVERLAP = 12  # minimum overlap of two shifted signals, in samples
_MAX_CORRELATION = 0.999
_MIN_POWER = 1e-9  # a signal below this power counts as silent
_MAX_SWEEPS = 50


@dataclass(frozen=True, slots=True)
class Shift:
    """Start time of a recording relative to the common timeline of all recordings.

    Attributes:
        samples: Shift in samples; sample `t` of the common timeline is sample `t + samples` of
            this recording.
        confidence: Peak correlation minus the highest correlation outside the peak, in standard
            deviations of the correlations outside the peak.
    """

    samples: float
    confidence: float


def align_signals(
    signal_count: int, correlate: Callable[[int, int], Float64Array | None], peak_width: int
) -> list[Shift]:
    """Estimate the shift of each signal; the median shift is 0.

    Args:
        signal_count: Number of signals.
        correlate: Function that takes the indices of two signals and returns their correlation
            curve, as `correlate_signals` does, or None if the signals cannot be compared. All
            curves have the same length.
        peak_width: Maximum distance, in samples, of a shift from the peak to which it belongs.
    """
    curves = _correlate_pairs(signal_count, correlate)
    shifts = max(
        (
            _optimize_shifts(curves, initial_shifts)
            for initial_shifts in (np.zeros(signal_count, np.int64), _find_shifts_greedily(curves))
        ),
        key=lambda aligned: _sum_pair_correlations(curves, aligned),
    )
    median_shift, max_shift = int(np.median(shifts)), curves.shape[2] // 2
    aligned = []
    for index in range(signal_count):
        curve = _sum_curves(curves, shifts, index, range(signal_count))
        peak = int(shifts[index]) + max_shift
        refined_shift = float(shifts[index] - median_shift) + _find_parabola_peak(curve, peak)
        aligned.append(Shift(refined_shift, _measure_confidence(curve, peak, peak_width)))
    return aligned


def correlate_signals(first: Float64Array, second: Float64Array, max_shift: int) -> Float64Array:
    """Correlate two signals at each shift of the second signal.

    Args:
        first: `[T, K]` signal of K values per sample.
        second: `[U, K]` signal of K values per sample.
        max_shift: Maximum shift in either direction, in samples.

    Returns:
        `[2 * max_shift + 1]` normalized correlation of `first[t]` and `second[t + shift]`,
        converted to Fisher's z and divided by its standard error; 0 if the overlap is too short.
    """
    constant_signals = np.ones((len(first), 1)), np.ones((len(second), 1))
    products = _cross_correlate(first, second)
    powers = [
        _cross_correlate((first**2).sum(axis=1, keepdims=True), constant_signals[1]),
        _cross_correlate(constant_signals[0], (second**2).sum(axis=1, keepdims=True)),
    ]
    overlap = np.rint(_cross_correlate(*constant_signals))
    product_indices = np.arange(-max_shift, max_shift + 1) + len(first) - 1
    is_inside = (product_indices >= 0) & (product_indices < len(products))
    valid_indices = product_indices[is_inside]
    norm = np.sqrt(
        np.maximum(powers[0][valid_indices], 0) * np.maximum(powers[1][valid_indices], 0)
    )
    correlation = np.divide(
        products[valid_indices],
        norm,
        out=np.zeros(len(valid_indices)),
        where=norm > _MIN_POWER,
    )
    correlation = np.clip(correlation, -_MAX_CORRELATION, _MAX_CORRELATION)
    weight = np.sqrt(np.maximum(overlap[valid_indices] - 3, 0)) * (
        overlap[valid_indices] >= _MIN_OVERLAP
    )
    curve = np.zeros(2 * max_shift + 1)
    curve[is_inside] = np.arctanh(correlation) * weight
    return curve


def subtract_running_mean(signal: Float64Array, window: int) -> Float64Array:
    """Remove slow trends from a signal by subtracting its running mean.

    Args:
        signal: `[T, K]` signal.
        window: Length of the running mean in samples, odd.
    """
    mean = uniform_filter1d(signal, window, axis=0, mode="nearest")
    return np.asarray(signal - mean, np.float64)


def _cross_correlate(first: Float64Array, second: Float64Array) -> Float64Array:
    """Return, for every shift, the sum over `t` of `first[t]` times `second[t + shift]`."""
    correlation: Float64Array = fftconvolve(second, first[::-1], axes=0).sum(axis=1)
    return correlation


def _correlate_pairs(
    signal_count: int, correlate: Callable[[int, int], Float64Array | None]
) -> NDArray[np.float32]:
    """Return the correlation curves of all pairs as an array `[first, second, shift]`."""
    curve_by_pair = {
        (first, second): curve
        for first in range(signal_count)
        for second in range(first + 1, signal_count)
        if (curve := correlate(first, second)) is not None
    }
    length = max(map(len, curve_by_pair.values()), default=1)
    curves = np.zeros((signal_count, signal_count, length), np.float32)
    for (first, second), curve in curve_by_pair.items():
        curves[first, second], curves[second, first] = curve, curve[::-1]
    return curves


def _sum_curves(
    curves: NDArray[np.float32], shifts: NDArray[np.int64], index: int, other_indices: Sequence[int]
) -> Float64Array:
    """Return, for each shift of a signal, the sum of its correlations with the other signals."""
    width = curves.shape[2]
    curve_sum = np.zeros(width)
    for other_index in other_indices:
        if other_index != index:
            shift = int(shifts[other_index])
            pair_curve = curves[other_index, index]
            if shift >= 0:
                curve_sum[shift:] += pair_curve[: width - shift]
            else:
                curve_sum[:shift] += pair_curve[-shift:]
    return curve_sum


def _find_shifts_greedily(curves: NDArray[np.float32]) -> NDArray[np.int64]:
    """Align one signal after another, always choosing the best match to those already aligned."""
    signal_count, max_shift = len(curves), curves.shape[2] // 2
    shifts = np.zeros(signal_count, np.int64)
    aligned_indices = [int(curves.max(axis=2).sum(axis=1).argmax())]
    while len(aligned_indices) < signal_count:
        sums = {
            index: _sum_curves(curves, shifts, index, aligned_indices)
            for index in range(signal_count)
            if index not in aligned_indices
        }
        best_index = max(sums, key=lambda index: float(sums[index].max()))
        shifts[best_index] = int(sums[best_index].argmax()) - max_shift
        aligned_indices.append(best_index)
    return shifts


def _optimize_shifts(
    curves: NDArray[np.float32], initial_shifts: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Change one shift at a time until no change increases the sum of all correlations."""
    shifts, max_shift = initial_shifts.copy(), curves.shape[2] // 2
    for _ in range(_MAX_SWEEPS):
        previous = shifts.copy()
        for index in range(len(shifts)):
            curve = _sum_curves(curves, shifts, index, range(len(shifts)))
            shifts[index] = int(curve.argmax()) - max_shift
        if (shifts == previous).all():
            break
    return shifts


def _sum_pair_correlations(curves: NDArray[np.float32], shifts: NDArray[np.int64]) -> float:
    max_shift = curves.shape[2] // 2
    shift_indices = np.clip(shifts[None, :] - shifts[:, None], -max_shift, max_shift) + max_shift
    first, second = np.indices(shift_indices.shape)
    return float(curves[first, second, shift_indices].sum())


def _find_parabola_peak(curve: Float64Array, peak: int) -> float:
    """Fit a parabola to a peak and its neighbors; return its vertex relative to the peak."""
    if not 0 < peak < len(curve) - 1:
        return 0.0
    before_peak, peak_value, after_peak = curve[peak - 1 : peak + 2]
    curvature = before_peak - 2 * peak_value + after_peak
    return (
        float(np.clip(0.5 * (before_peak - after_peak) / curvature, -0.5, 0.5))
        if curvature < 0
        else 0.0
    )


def _measure_confidence(curve: Float64Array, peak: int, peak_width: int) -> float:
    is_outside_peak = np.abs(np.arange(len(curve)) - peak) > peak_width
    other_values = curve[is_outside_peak]
    deviation = float(other_values.std()) if other_values.size else 0.0
    return float((curve[peak] - other_values.max()) / deviation) if deviation > 0 else 0.0
