import numpy as np
import pytest

from quarc_ref.decoder import Splats
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.pictures import render_depth
from quarc_ref.viewing.depth_levels import quantize_depth

_CAMERA = Camera(
    "cam", 32, 24, 30.0, 30.0, 16.0, 12.0, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0, 0, 0), 0.1, False
)


def _make_walls(*walls):
    """Return large flat Gaussians; each argument is a depth and an opacity logit."""
    count = len(walls)
    depths, logits = np.array(walls, dtype=np.float32).T
    positions = np.zeros((count, 3), dtype=np.float32)
    positions[:, 2] = depths
    return Splats(
        positions,
        np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (count, 1)),
        np.tile(np.log(np.array([30, 30, 0.01], dtype=np.float32)), (count, 1)),
        logits,
        np.zeros((count, 1, 3), dtype=np.float32),
    )


def test_depth_is_that_of_the_wall_even_if_faint():
    for logit in (-1.0, 4.0):
        depth, opacity = render_depth(_make_walls((3.0, logit)), _CAMERA)
        assert depth == pytest.approx(np.full((24, 32), 3.0), rel=1e-4)
        assert opacity == pytest.approx(np.full((24, 32), 1 / (1 + np.exp(-logit))), rel=2e-2)


def test_the_front_one_of_two_walls_contributes_its_share_of_the_depth():
    depth, _ = render_depth(_make_walls((2.0, 0.0), (6.0, 9.0)), _CAMERA)

    assert depth[12, 16] == pytest.approx((0.5 * 2 + 0.5 * 0.99 * 6) / (0.5 + 0.5 * 0.99), rel=1e-2)


def test_empty_pixels_have_no_depth():
    depth, opacity = render_depth(_make_walls((-3.0, 4.0)), _CAMERA)

    assert not depth.any()
    assert not opacity.any()


def test_levels_have_the_finest_scale_that_fits():
    depth = np.array([[1.0, 7.5, 3.0]], dtype=np.float32)
    levels, scale = quantize_depth(depth, np.array([[1, 1, 0.2]], dtype=np.float32))

    assert np.log2(scale) == round(np.log2(scale))
    assert 1 << 15 <= levels.max() < 1 << 16
    assert levels[0, :2] * scale == pytest.approx(depth[0, :2], abs=scale)
    assert levels[0, 2] == 0
    assert quantize_depth(0 * depth, depth)[1] == 1


def test_only_pixels_without_a_depth_have_level_0():
    depth = np.array([[1e-3, 1e5, 0, np.inf, np.nan]], dtype=np.float32)
    levels, scale = quantize_depth(depth, np.ones_like(depth))

    assert scale == 2
    assert levels.tolist() == [[1, 50_000, 0, 0, 0]]
