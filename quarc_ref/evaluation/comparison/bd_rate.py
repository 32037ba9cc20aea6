"""Computes Bjontegaard deltas: differences in rate at equal quality and in quality at equal rate.

The package `bjontegaard` computes the deltas with Akima interpolation, the most robust of
its interpolation methods (Herglotz et al., ICIP 2022).
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from quarc_ref.wording import format_count

MIN_POINTS = 4
_INTERPOLATION = "akima"

Curve = Sequence[tuple[float, float]]  # rate and quality of each operating point


@dataclass(frozen=True, slots=True)
class BjontegaardDeltas:
    """Bjontegaard deltas between a method and the reference method.

    Attributes:
        rate: BD-rate in percent, negative if the method needs fewer bytes; None if the
            curves do not overlap.
        quality: BD-PSNR in dB, or the corresponding delta of another metric in its own unit.
        remark: Reason why a delta is None, or warnings about the accuracy; otherwise empty.
    """

    rate: float | None
    quality: float | None
    remark: str


def compare_curves(reference: Curve, curve: Curve) -> BjontegaardDeltas:
    """Compute the Bjontegaard deltas of a curve relative to a reference curve.

    Args:
        reference: Rate (in any unit) and quality (higher is better) of each operating
            point of the reference method.
        curve: Rate and quality of each operating point of the other method.

    Returns:
        The deltas. If a curve has fewer than four points, a rate that is not positive or that two
        points share, or a quality that does not increase with the rate, both deltas are None, and
        the remark gives the reason.
    """
    for name, points in (("the reference", reference), ("the method", curve)):
        problem = _find_problem(name, points)
        if problem is not None:
            return BjontegaardDeltas(None, None, problem)
    import bjontegaard

    reference_points, curve_points = sorted(reference), sorted(curve)
    rates_and_qualities = (*zip(*reference_points, strict=True), *zip(*curve_points, strict=True))
    with warnings.catch_warnings(record=True) as caught_warnings:
        warnings.simplefilter("always")
        rate = float(
            bjontegaard.bd_rate(*rates_and_qualities, _INTERPOLATION, require_matching_points=False)
        )
        quality = float(
            bjontegaard.bd_psnr(*rates_and_qualities, _INTERPOLATION, require_matching_points=False)
        )
    remarks = dict.fromkeys(
        str(warning.message).partition(" You can")[0] for warning in caught_warnings
    )
    return BjontegaardDeltas(_finite_or_none(rate), _finite_or_none(quality), " ".join(remarks))


def _find_problem(name: str, points: Curve) -> str | None:
    """Return the reason why a curve has no deltas; None if it has deltas."""
    if len(points) < MIN_POINTS:
        point_count = f"{format_count(len(points), 'point')} of known size"
        return f"{name} has {point_count}; {MIN_POINTS} are needed"
    rates, qualities = zip(*sorted(points), strict=True)
    if rates[0] <= 0:
        return f"{name} has a point of 0 bytes"
    if not _is_increasing(rates):
        return f"{name} has two points of the same rate"
    if not _is_increasing(qualities):
        return f"the quality of {name} does not increase with the rate"
    return None


def _is_increasing(numbers: Sequence[float]) -> bool:
    return all(low < high for low, high in pairwise(numbers))


def _finite_or_none(number: float) -> float | None:
    return number if math.isfinite(number) else None
