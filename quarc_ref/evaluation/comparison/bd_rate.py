"""Bjontegaard deltas: the difference in rate between methods at the same quality.

Computed by the package `bjontegaard`, with Akima interpolation, the most robust of its
methods (Herglotz et al., ICIP 2022).
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from quarc_ref.inspection.wording import count_noun

MIN_RATES = 4
_METHOD = "akima"

Curve = Sequence[tuple[float, float]]  # rate and quality of each operating point


@dataclass(frozen=True, slots=True)
class Delta:
    """Difference between a method and the reference method.

    Attributes:
        rate: BD-rate in percent, negative if the method needs fewer bytes; None if the
            curves do not overlap.
        quality: BD-PSNR, or the delta of another metric in its units.
        remark: Limitations of the result; empty if there are none.
    """

    rate: float | None
    quality: float | None
    remark: str


def compare_curves(reference: Curve, curve: Curve) -> Delta:
    """Compute the Bjontegaard deltas of a curve.

    Args:
        reference: Rate (in any unit) and quality (higher is better) of each operating
            point of the reference method.
        curve: Rate and quality of each operating point of the other method.

    Returns:
        The deltas. They are None, with a remark, for fewer than four points or
        non-monotonic curves.
    """
    for name, points in (("the reference", reference), ("it", curve)):
        if len(points) < MIN_RATES:
            has = f"{count_noun(len(points), 'point')} of known size"
            return Delta(None, None, f"{name} has {has}; {MIN_RATES} are needed")
        if not _is_monotonic(points):
            return Delta(None, None, f"the quality of {name} does not increase with its rate")
    import bjontegaard

    first, second = sorted(reference), sorted(curve)
    arguments = (*zip(*first, strict=True), *zip(*second, strict=True))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        rate = float(bjontegaard.bd_rate(*arguments, _METHOD, require_matching_points=False))
        quality = float(bjontegaard.bd_psnr(*arguments, _METHOD, require_matching_points=False))
    remarks = dict.fromkeys(str(each.message).partition(" You can")[0] for each in caught)
    return Delta(_finite(rate), _finite(quality), " ".join(remarks))


def _is_monotonic(points: Curve) -> bool:
    qualities = [quality for _, quality in sorted(points)]
    return all(low < high for low, high in pairwise(qualities))


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None
