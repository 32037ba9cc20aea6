import numpy as np
import pytest
from scipy.special import sph_harm_y

from quarc_ref.decoder import Splats
from quarc_ref.format import constants
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering import projection_kernels
from quarc_ref.rendering.harmonics import evaluate_basis, fold_harmonics
from quarc_ref.rendering.pictures import render_picture

_CAMERA = Camera(
    "cam", 32, 24, 30.0, 30.0, 16.0, 12.0, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0, 0, 4), 0.1, False
)


def _make_directions(count=20):
    samples = np.random.default_rng(3).normal(size=(count, 3))
    return samples / np.linalg.norm(samples, axis=1, keepdims=True)


def _real_harmonic(degree, order, directions):
    """Return a real harmonic, from scipy's complex harmonics with the Condon-Shortley phase."""
    x, y, z = directions.T
    value = sph_harm_y(degree, abs(order), np.arccos(z), np.arctan2(y, x))
    if order == 0:
        return value.real
    return np.sqrt(2) * (value.imag if order < 0 else value.real)


def test_the_basis_equals_that_of_scipy():
    directions = _make_directions()
    expected = [
        _real_harmonic(degree, order, directions)
        for degree in range(4)
        for order in range(-degree, degree + 1)
    ]

    assert evaluate_basis(directions) == pytest.approx(np.stack(expected, axis=1), abs=1e-12)


def _make_splats(coefficients, count=30):
    rng = np.random.default_rng(1)
    return Splats(
        rng.uniform(-1, 1, (count, 3)).astype(np.float32),
        np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (count, 1)),
        np.full((count, 3), -2, dtype=np.float32),
        np.full(count, 2, dtype=np.float32),
        rng.normal(scale=0.3, size=(count, coefficients, 3)).astype(np.float32),
    )


def test_folded_colors_equal_those_of_the_kernels():
    splats = _make_splats(4)
    camera_position = np.array([0.0, 0.0, -4.0])
    folded = Splats(
        splats.positions,
        splats.rotations,
        splats.log_scales,
        splats.opacities,
        fold_harmonics(splats.sh, splats.positions, camera_position),
    )

    assert render_picture(folded, _CAMERA) == pytest.approx(
        render_picture(splats, _CAMERA), abs=1e-5
    )


@pytest.mark.parametrize("coefficients", [9, 16])
def test_higher_degrees_are_rendered_and_zeros_change_nothing(coefficients):
    splats = _make_splats(coefficients)
    low_degree = Splats(
        splats.positions, splats.rotations, splats.log_scales, splats.opacities, splats.sh[:, :4]
    )
    padded = np.zeros_like(splats.sh)
    padded[:, :4] = splats.sh[:, :4]
    zero_padded = Splats(
        splats.positions, splats.rotations, splats.log_scales, splats.opacities, padded
    )

    assert render_picture(zero_padded, _CAMERA) == pytest.approx(
        render_picture(low_degree, _CAMERA), abs=1e-5
    )
    assert (
        np.abs(render_picture(splats, _CAMERA) - render_picture(low_degree, _CAMERA)).max() > 0.02
    )


def test_the_factors_of_spherical_harmonics_are_those_of_the_format():
    assert np.float32(constants.SH_C0) == projection_kernels.SH_C0
    assert np.float32(constants.SH_C1) == projection_kernels.SH_C1
