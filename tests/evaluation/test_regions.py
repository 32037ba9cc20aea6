import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quarc_ref.evaluation.regions import (
    choose_background_frames,
    find_background,
    find_moving_region,
)

PICTURES = arrays(np.uint8, (6, 7, 3))


def _make_video(frame_count, step=6, side=4):
    """Pictures of a gray wall with a white square that moves right, and the square's slices."""
    pictures = np.full((frame_count, 24, 40, 3), 90, dtype=np.uint8)
    squares = [
        (slice(8, 8 + side), slice(step * frame, step * frame + side))
        for frame in range(frame_count)
    ]
    for picture, square in zip(pictures, squares, strict=True):
        picture[square] = 250
    return pictures, squares


@given(count=st.integers(1, 500))
def test_the_frames_of_the_median_are_few_and_spread_over_the_capture(count):
    frames = choose_background_frames(count)
    gaps = np.diff(frames)

    assert len(frames) == min(count, 15)
    assert frames[0] == 0
    assert count == 1 or frames[-1] == count - 1
    assert count == 1 or gaps.min() >= max(1, gaps.max() - 1)


@given(picture=PICTURES, count=st.integers(3, 9))
def test_a_static_capture_has_no_moving_region(picture, count):
    background = find_background([picture] * count)

    assert not find_moving_region(picture, background).any()


@given(
    picture=arrays(np.uint8, (6, 7, 3), elements=st.integers(8, 247)),
    noise=arrays(np.int8, (6, 7, 3), elements=st.integers(-7, 7)),
)
def test_noise_is_not_motion(picture, noise):
    noisy = (picture + noise).astype(np.uint8)
    background = find_background([picture, noisy, picture])

    assert not find_moving_region(noisy, background).any()


@pytest.mark.parametrize("frame", range(6))
def test_a_moving_square_is_found_with_a_margin_of_two_pixels(frame):
    pictures, squares = _make_video(6)
    moving = find_moving_region(pictures[frame], find_background(pictures))

    rows, columns = squares[frame]
    expected = np.zeros((24, 40), dtype=bool)
    expected[rows.start - 2 : rows.stop + 2, max(columns.start - 2, 0) : columns.stop + 2] = True
    assert np.array_equal(moving, expected)


@pytest.mark.parametrize(("levels", "is_moving"), [(15, False), (16, True)])
def test_more_than_fifteen_levels_in_one_color_are_motion(levels, is_moving):
    wall = np.full((5, 5, 3), 100, dtype=np.uint8)
    changed = wall.copy()
    changed[2, 2, 1] += levels
    background = find_background([wall, wall, changed])

    assert find_moving_region(changed, background).any() == is_moving
    assert not find_moving_region(wall, background).any()


@pytest.mark.parametrize("count", [1, 2])
def test_fewer_than_three_frames_give_no_moving_region(count):
    assert find_background(list(_make_video(count)[0])) is None
