"""Tests of undistortion with pictures that are distorted by formulas."""

import numpy as np
import pytest

from quarc_ref.datasets.calibration import Lens
from quarc_ref.datasets.errors import UnsupportedCameraError
from quarc_ref.datasets.undistortion import Rectifier
from tests.datasets.lenses import BARREL, DISTORTED_LENSES, distort


def undistort_by_formula(lens, u, v):
    """Return the direction (x, y, 1) of each pixel, found by fixed-point iteration."""
    x, y = (u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy
    for _ in range(300):
        distorted_u, distorted_v = distort(lens, x, y)
        x, y = x - 0.5 * (distorted_u - u) / lens.fx, y - 0.5 * (distorted_v - v) / lens.fy
    return x, y


def paint_direction(x, y):
    """Return the sRGB color of a direction; colors vary smoothly."""
    channels = [np.sin(3 * x + y), np.cos(2 * y - x), np.sin(2 * x * y + 1)]
    return 128 + 90 * np.stack(channels, axis=-1)


def make_pixel_centers(lens):
    return np.meshgrid(np.arange(lens.width) + 0.5, np.arange(lens.height) + 0.5)


def draw_distorted(lens):
    """Return the picture `[H, W, 3]` (uint8) that a lens with distortion forms."""
    return (paint_direction(*undistort_by_formula(lens, *make_pixel_centers(lens))) + 0.5).astype(
        np.uint8
    )


def draw_undistorted(lens):
    """Return the picture `[H, W, 3]` (float) that a pinhole camera forms."""
    u, v = make_pixel_centers(lens)
    return paint_direction((u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy)


@pytest.mark.parametrize("lens", DISTORTED_LENSES)
def test_a_distorted_picture_becomes_the_pinholes_up_to_its_border(lens):
    rectifier = Rectifier(lens)
    undistorted = rectifier.rectify(draw_distorted(lens))

    assert undistorted.shape == (64, 96, 3)
    # Rounding alone has a mean error of 0.3. Half a pixel would give 0.6, or 2.4 for a fisheye,
    # whose stretched corners are sensitive to the filter.
    error = np.abs(undistorted - draw_undistorted(rectifier.lens))
    assert error.mean() < (0.6 if lens.fisheye else 0.4)
    assert error.max() < 6.0


@pytest.mark.parametrize("lens", DISTORTED_LENSES)
def test_the_pinhole_sees_only_the_picture_and_touches_its_border(lens):
    pinhole = Rectifier(lens).lens
    u, v = make_pixel_centers(pinhole)
    distorted_u, distorted_v = distort(
        lens, (u - pinhole.cx) / pinhole.fx, (v - pinhole.cy) / pinhole.fy
    )

    for values, size in ((distorted_u, lens.width), (distorted_v, lens.height)):
        assert values.min() == pytest.approx(0.5, abs=0.03)
        assert values.max() == pytest.approx(size - 0.5, abs=0.03)


def test_pictures_are_undistorted_one_after_another():
    rectifier = Rectifier(BARREL)
    picture = draw_distorted(BARREL)
    undistorted = rectifier.rectify(picture)
    undistorted_negative = rectifier.rectify(255 - picture)

    assert np.abs(255.0 - undistorted_negative - undistorted).max() <= 1
    assert np.array_equal(rectifier.rectify(picture), undistorted)


def test_a_pinholes_picture_is_unchanged():
    lens = Lens(96, 64, 70.0, 72.0, 50.0, 30.0, (0.0, 0.0))
    picture = draw_distorted(lens)
    rectifier = Rectifier(lens)

    assert rectifier.lens == lens
    assert rectifier.rectify(picture) is picture


def test_a_downscaled_picture_is_the_mean_of_its_pixels_without_the_remainder():
    picture = np.random.default_rng(0).integers(0, 256, (64, 96, 3), dtype=np.uint8)
    rectifier = Rectifier(Lens(96, 64, 70.0, 72.0, 50.0, 30.0), 5)
    downscaled = rectifier.rectify(picture)
    block_means = picture[:60, :95].reshape(12, 5, 19, 5, 3).mean(axis=(1, 3))

    assert downscaled.shape == (12, 19, 3)
    assert np.abs(downscaled - block_means).max() <= 0.5


def test_the_lens_of_a_downscaled_picture_has_the_same_directions():
    lens = Lens(96, 64, 70.0, 72.0, 50.0, 30.0)
    rectifier = Rectifier(lens, 2)
    downscaled = rectifier.rectify(draw_distorted(lens))

    assert rectifier.lens == Lens(48, 32, 35.0, 36.0, 25.0, 15.0)
    assert np.abs(downscaled - draw_undistorted(rectifier.lens)).max() < 2.0


def test_a_distorted_picture_is_undistorted_before_it_is_downscaled():
    rectifier = Rectifier(BARREL, 2)
    downscaled = rectifier.rectify(draw_distorted(BARREL))

    assert downscaled.shape == (32, 48, 3)
    assert np.abs(downscaled - draw_undistorted(rectifier.lens)).max() < 3.0


@pytest.mark.parametrize("downscale", [0, -1, 65])
def test_a_downscale_that_leaves_no_pixels_is_rejected(downscale):
    with pytest.raises(ValueError, match="cannot be downscaled"):
        Rectifier(Lens(96, 64, 70.0, 72.0, 50.0, 30.0), downscale)


@pytest.mark.parametrize(
    "lens",
    [
        Lens(96, 64, 10.0, 10.0, 48.0, 32.0, fisheye=True),  # beyond 180 degrees
        Lens(96, 64, 20.0, 20.0, 48.0, 32.0, (-0.9, 0.0)),  # not monotonic
    ],
)
def test_a_lens_without_a_matching_pinhole_is_rejected(lens):
    with pytest.raises(UnsupportedCameraError, match=r"too wide|cannot be inverted"):
        Rectifier(lens)
