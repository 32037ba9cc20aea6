"""The upper convex hull of rate and quality."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise


@dataclass(frozen=True, slots=True)
class Point:
    """Settings measured.

    Attributes:
        label: Changes from the default; empty for the default itself.
        kilobytes: KB per frame, with the canonical frame amortized over 300.
        psnr: PSNR of held-out cameras in dB, mean of the frames.
    """

    label: str
    kilobytes: float
    psnr: float


def upper_hull(points: Sequence[Point]) -> list[Point]:
    """Return the points on the upper convex hull, from the lowest rate to the best quality."""
    hull: list[Point] = []
    for point in sorted(points, key=lambda each: (each.kilobytes, -each.psnr)):
        if hull and point.psnr <= hull[-1].psnr:
            continue
        while len(hull) > 1 and _gain(hull[-2], hull[-1]) <= _gain(hull[-1], point):
            hull.pop()
        hull.append(point)
    return hull


def gap_to_hull(point: Point, hull: Sequence[Point]) -> float:
    """Return how many dB a point is below a hull at its own rate; 0 on the hull.

    Args:
        point: One of the points of the hull.
        hull: Result of `upper_hull`.
    """
    if point in hull:
        return 0.0  # not a rounding error
    for left, right in pairwise(hull):
        if left.kilobytes <= point.kilobytes <= right.kilobytes:
            reached = left.psnr + _gain(left, right) * (point.kilobytes - left.kilobytes)
            return max(0.0, reached - point.psnr)
    best = hull[-1] if point.kilobytes > hull[-1].kilobytes else hull[0]
    return max(0.0, best.psnr - point.psnr)


def _gain(left: Point, right: Point) -> float:
    """Return dB per KB from a point to one of a higher rate."""
    return (right.psnr - left.psnr) / (right.kilobytes - left.kilobytes)
