"""The upper hull of rate and quality: what no mixture of other settings betters."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise


@dataclass(frozen=True, slots=True)
class Point:
    """Settings measured.

    Attributes:
        label: What is changed of the default; empty for the default itself.
        kilobytes: Per frame, the canonical frame spread over 300.
        psnr: Held out, mean of the frames, dB.
    """

    label: str
    kilobytes: float
    psnr: float


def upper_hull(points: Sequence[Point]) -> list[Point]:
    """Return the points on the upper convex hull, from the least rate to the best quality."""
    hull: list[Point] = []
    for point in sorted(points, key=lambda each: (each.kilobytes, -each.psnr)):
        if hull and point.psnr <= hull[-1].psnr:
            continue
        while len(hull) > 1 and _gain(hull[-2], hull[-1]) <= _gain(hull[-1], point):
            hull.pop()
        hull.append(point)
    return hull


def gap_below(point: Point, hull: Sequence[Point]) -> float:
    """Return by how many dB a point is below a hull at its own rate; 0 on the hull.

    Args:
        point: One of those that the hull is of.
        hull: As `upper_hull` gives it.
    """
    if point in hull:
        return 0.0  # and not what rounding makes of it
    for left, right in pairwise(hull):
        if left.kilobytes <= point.kilobytes <= right.kilobytes:
            reached = left.psnr + _gain(left, right) * (point.kilobytes - left.kilobytes)
            return max(0.0, reached - point.psnr)
    best = hull[-1] if point.kilobytes > hull[-1].kilobytes else hull[0]
    return max(0.0, best.psnr - point.psnr)


def _gain(left: Point, right: Point) -> float:
    """Return dB per KB from a point to one of a greater rate."""
    return (right.psnr - left.psnr) / (right.kilobytes - left.kilobytes)
