from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rate.hull import Point, find_upper_hull, measure_gap_to_hull

POINT_LISTS = st.lists(
    st.builds(Point, st.just(""), st.integers(1, 40).map(float), st.integers(0, 40).map(float)),
    min_size=1,
    max_size=12,
)
KNOWN_POINTS = [
    Point("a", 1.0, 20.0),
    Point("b", 2.0, 24.0),
    Point("under a-b", 1.5, 21.0),
    Point("c", 4.0, 26.0),
    Point("under b-c", 3.0, 24.5),
    Point("worse than c at more", 5.0, 25.0),
]


def test_a_known_hull():
    assert [point.label for point in find_upper_hull(KNOWN_POINTS)] == ["a", "b", "c"]


@pytest.mark.parametrize(
    ("label", "gap"),
    [("a", 0), ("b", 0), ("under a-b", 1.0), ("under b-c", 0.5), ("worse than c at more", 1.0)],
)
def test_known_gaps(label, gap):
    (point,) = [candidate for candidate in KNOWN_POINTS if candidate.label == label]

    assert measure_gap_to_hull(point, find_upper_hull(KNOWN_POINTS)) == pytest.approx(gap)


@given(POINT_LISTS)
def test_the_hull_contains_points_and_its_slope_falls(points):
    hull = find_upper_hull(points)
    slopes = [
        (right.psnr - left.psnr) / (right.kilobytes - left.kilobytes)
        for left, right in pairwise(hull)
    ]

    assert set(hull) <= set(points)
    assert all(slope > 0 for slope in slopes)
    assert slopes == sorted(slopes, reverse=True)
    assert len(set(slopes)) == len(slopes)


@given(POINT_LISTS)
def test_no_point_and_no_mixture_of_two_is_above_the_hull(points):
    hull = find_upper_hull(points)

    assert all(measure_gap_to_hull(point, hull) == 0 for point in hull)
    for first_point in points:
        for second_point in points:
            middle = Point(
                "",
                (first_point.kilobytes + second_point.kilobytes) / 2,
                (first_point.psnr + second_point.psnr) / 2,
            )
            assert find_upper_hull([*points, middle]) == hull


@given(POINT_LISTS, st.sampled_from([0.25, 0.5, 2.0]))
def test_a_gap_lifts_a_point_onto_the_hull(points, lift):
    hull = find_upper_hull(points)

    for point in points:
        gap = measure_gap_to_hull(point, hull)
        lifted_point = Point("", point.kilobytes, point.psnr + gap + lift)
        assert lifted_point in find_upper_hull([*points, lifted_point])
        assert measure_gap_to_hull(Point("", point.kilobytes, point.psnr + gap), hull) <= 1e-9


@given(POINT_LISTS)
def test_the_best_quality_and_the_lowest_rate_are_on_the_hull(points):
    hull = find_upper_hull(points)

    assert hull[-1].psnr == max(point.psnr for point in points)
    assert hull[0].kilobytes == min(point.kilobytes for point in points)
