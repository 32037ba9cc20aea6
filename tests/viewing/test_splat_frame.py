from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.decoder import dequantize
from quarc_ref.format.records import StreamHeader
from quarc_ref.rendering.pictures import SH_COEFFICIENTS
from quarc_ref.rendering.pipeline import project
from quarc_ref.rendering.pipeline_data import Drawn
from quarc_ref.viewing.splat_frame import choose_unit, make_splats
from tests.small_streams import CAMERA, make_stream


@cache
def _scene(**header):
    fields = {"seed": 7, "gaussians_per_anchor": 4, **header}
    return make_stream(StreamHeader(**fields), frame_count=1)[1][0].scene


def _matrix(quaternion):
    """The rotation of a unit quaternion wxyz, by what it does to the axes."""
    w, v = quaternion[0], quaternion[1:]
    turn = [axis + 2 * np.cross(v, np.cross(v, axis) + w * axis) for axis in np.eye(3)]
    return np.stack(turn, axis=1)


def test_covariances_are_those_of_the_scales_and_rotations():
    scene = _scene()
    splats = dequantize(scene)
    unit = choose_unit(splats)
    shown = make_splats(splats, unit)

    for i in range(scene.count):
        axes = _matrix(splats.rotations[i].astype(float)) * np.exp(splats.log_scales[i]) / unit
        covariance = axes @ axes.T
        reach = np.abs(covariance).max()
        assert shown.covariances[i].astype(float) / reach == pytest.approx(
            covariance / reach, abs=2e-3
        )


def test_centers_and_opacities_are_those_of_the_scene():
    scene = _scene()
    splats = dequantize(scene)
    shown = make_splats(splats, 0.25)

    assert shown.centers * 0.25 == pytest.approx(splats.positions, abs=1e-6)
    opacities = np.minimum(1 / (1 + np.exp(-splats.opacities.astype(float))), 0.99)
    assert shown.opacities[:, 0] / 255 == pytest.approx(opacities, abs=0.6 / 255)
    assert shown.opacities.shape == (scene.count, 1)


@pytest.mark.parametrize("code", [-32767, 32767])
def test_the_largest_and_the_least_that_a_stream_can_say_are_numbers(code):
    scene = _scene(log_scale_step=1024.0, opacity_step=1024.0)
    splats = dequantize(replace(scene, codes=np.full_like(scene.codes, code)))
    shown = make_splats(splats, choose_unit(splats))

    assert shown.unit > 0
    for numbers in (shown.centers, shown.covariances, shown.opacities):
        assert np.isfinite(numbers).all()


@given(st.integers(-40, 40))
def test_whatever_the_scale_of_a_scene_covariances_fit_half_precision(exponent):
    """Codes of log-scales are whole; so is their shift by a common power of two."""
    step = np.log(2) / 64
    scene = _scene(log_scale_step=float(np.float32(step)))
    codes = scene.codes.copy()
    codes[:3] = codes[:3] // 16 + 64 * exponent
    scene = type(scene)(scene.header, 0, 0, scene.ids, scene.positions, scene.rotations, codes)
    splats = dequantize(scene)
    covariances = make_splats(splats, choose_unit(splats)).covariances

    diagonal = np.diagonal(covariances, axis1=1, axis2=2).astype(float)
    assert np.isfinite(covariances).all()
    assert diagonal.min() > 1e-3
    assert diagonal.max() < 1e3


@pytest.mark.parametrize("degree", [0, 1])
def test_colors_are_those_of_the_rasterizer(degree):
    scene = _scene(sh_degree=degree)
    splats = dequantize(scene)
    sh = np.zeros((scene.count, SH_COEFFICIENTS, 3), dtype=np.float32)
    sh[:, : splats.sh.shape[1]] = splats.sh
    ones = np.ones((scene.count, 3), dtype=np.float32)
    drawn = Drawn(splats.positions, splats.rotations, 0.01 * ones, 0.9 * ones[:, 0], sh)
    projection = project(CAMERA, drawn)
    seen = projection.reaches > 0
    center = -np.array(CAMERA.rotation).reshape(3, 3).T @ np.array(CAMERA.translation)
    colors = make_splats(splats, 0.5).shade(center.astype(np.float32))

    assert seen.sum() > 10
    expected = np.clip(projection.colors[seen], 0, 1)
    assert colors[seen] / 255 == pytest.approx(expected, abs=2 / 255)


def test_colors_of_degree_1_depend_on_where_the_eye_is():
    shown = make_splats(dequantize(_scene()), 1.0)
    near, far = np.array([0, 0, -3.0]), np.array([0, 0, 3.0])

    assert not np.array_equal(shown.shade(near), shown.shade(far))


def test_memory_is_that_of_all_arrays():
    shown = make_splats(dequantize(_scene()), 1.0)

    assert shown.nbytes == shown.count * (12 + 18 + 1 + 24)


@pytest.mark.parametrize("eye", [0.0, 3e38, np.inf])
def test_codes_and_eyes_out_of_all_bounds_have_colors_without_a_warning(eye):
    scene = _scene()
    header = replace(scene.header, sh_dc_step=1024.0, sh_rest_step=1024.0)
    shown = make_splats(dequantize(replace(scene, header=header)), 1.0)

    assert np.isfinite(shown.sh).all()
    assert shown.shade(np.full(3, eye, dtype=np.float32)).shape == (shown.count, 3)
