"""Computes Bjontegaard deltas: differences in rate at equal quality and in quality at equal rate.

The package `bjontegaard` computes the deltas with Akima interpolation, the most robust of
its interpolation methods (Herglotz et al., ICIP 2022).
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from quarc_ref.inspection.wording import format_count

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
        The deltas. If a curve has fewer than four points, or its quality does not increase with the
        rate, both deltas are None, and the remark gives the reason.
    """
    for name, points in (("the reference", reference), ("the method", curve)):
        if len(points) < MIN_POINTS:
            point_count = f"{format_count(len(points), 'point')} of known size"
            return BjontegaardDeltas(
                None, None, f"{name} has {point_count}; {MIN_POINTS} are needed"
            )
        if not _is_quality_increasing(points):
            return BjontegaardDeltas(
                None, None, f"the quality of {name} does not increase with the rate"
            )
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


def _is_quality_increasing(points: Curve) -> bool:
    qualities = [quality for _, quality in sorted(points)]
    return all(low < high for low, high in pairwise(qualities))


def _finite_or_none(number: float) -> float | None:
    return number if math.isfinite(number) else None
