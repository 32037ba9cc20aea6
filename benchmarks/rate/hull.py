"""Computes the upper convex hull of rate-quality points."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise


@dataclass(frozen=True, slots=True)
class Point:
    """Rate and quality of a stream, with the settings that were changed.

    Attributes:
        label: Description of the changed settings; empty for the default settings.
        kilobytes: KB per frame, with the bytes of the canonical frame amortized over 300 frames.
        psnr: Mean PSNR of all frames on held-out cameras, in dB.
    """

    label: str
    kilobytes: float
    psnr: float


def find_upper_hull(points: Sequence[Point]) -> list[Point]:
    """Return the points on the upper convex hull, from the lowest to the highest rate."""
    hull: list[Point] = []
    for point in sorted(points, key=lambda candidate: (candidate.kilobytes, -candidate.psnr)):
        if hull and point.psnr <= hull[-1].psnr:
            continue
        while len(hull) > 1 and _compute_slope(hull[-2], hull[-1]) <= _compute_slope(
            hull[-1], point
        ):
            hull.pop()
        hull.append(point)
    return hull


def measure_gap_to_hull(point: Point, hull: Sequence[Point]) -> float:
    """Return by how many dB a point is below the hull at its rate; 0 if it is on the hull.

    Args:
        point: A point on or off the hull.
        hull: Result of `find_upper_hull`.
    """
    if point in hull:
        return 0.0  # without rounding errors
    for lower, upper in pairwise(hull):
        if lower.kilobytes <= point.kilobytes <= upper.kilobytes:
            hull_psnr = lower.psnr + _compute_slope(lower, upper) * (
                point.kilobytes - lower.kilobytes
            )
            return max(0.0, hull_psnr - point.psnr)
    nearest_point = hull[-1] if point.kilobytes > hull[-1].kilobytes else hull[0]
    return max(0.0, nearest_point.psnr - point.psnr)


def _compute_slope(start: Point, end: Point) -> float:
    """Return the slope in dB per KB from a point to another point with a higher rate."""
    return (end.psnr - start.psnr) / (end.kilobytes - start.kilobytes)
