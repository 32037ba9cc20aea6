import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

from quarc_ref.evaluation.metrics import (
    MAX_DECIBELS,
    PSNR_VARIANT,
    SSIM_VARIANT,
    measure_psnr,
    measure_ssim,
)

_SIZES = [(24, 31), (40, 40), (11, 64)]


def _make_pair(size, seed=0, noise=0.1):
    rng = np.random.default_rng(seed)
    truth = rng.random((*size, 3)).astype(np.float32)
    picture = np.clip(truth + rng.normal(0, noise, truth.shape), 0, 1).astype(np.float32)
    return picture, truth


def _map_scikit_image_ssim(picture, truth):
    """The SSIM of each pixel from scikit-image, with zero padding and our settings."""
    border = 12
    padding = ((border, border), (border, border), (0, 0))
    _, ssim_map = structural_similarity(
        np.pad(picture.astype(np.float64), padding),
        np.pad(truth.astype(np.float64), padding),
        data_range=1.0,
        channel_axis=2,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        full=True,
    )
    return ssim_map[border:-border, border:-border]


@pytest.mark.parametrize("size", _SIZES)
def test_psnr_equals_that_of_scikit_image(size):
    picture, truth = _make_pair(size)
    expected = peak_signal_noise_ratio(
        truth.astype(np.float64), picture.astype(np.float64), data_range=1.0
    )

    assert measure_psnr(picture, truth) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("size", _SIZES)
@pytest.mark.parametrize("noise", [0.02, 0.3])
def test_ssim_equals_that_of_scikit_image_with_zero_padding(size, noise):
    picture, truth = _make_pair(size, noise=noise)

    # `measure_ssim` sums 121 products of numbers up to 1 in float32.
    expected = _map_scikit_image_ssim(picture, truth).mean()
    assert measure_ssim(picture, truth) == pytest.approx(expected, abs=1e-5)


@given(st.integers(0, 1 << 30))
def test_with_a_mask_only_its_pixels_are_measured(seed):
    picture, truth = _make_pair((13, 17), seed)
    mask = np.random.default_rng(seed).random((13, 17)) < 0.3
    mask[5, 5] = True

    assert measure_psnr(picture, truth, mask) == measure_psnr(picture[mask], truth[mask])
    expected = _map_scikit_image_ssim(picture, truth)[mask].mean()
    assert measure_ssim(picture, truth, mask) == pytest.approx(expected, abs=1e-5)


def test_equal_pictures_have_the_maximum_psnr():
    picture, _ = _make_pair((24, 24))

    assert measure_psnr(picture, picture) == MAX_DECIBELS
    assert measure_psnr(picture, picture + np.float32(1e-6)) == MAX_DECIBELS
    assert measure_ssim(picture, picture) == pytest.approx(1, abs=1e-5)


@given(st.integers(1, 255))
def test_a_constant_error_has_its_known_psnr(levels):
    truth = np.zeros((4, 5, 3), dtype=np.float32)
    picture = truth + np.float32(levels / 255)

    assert measure_psnr(picture, truth) == pytest.approx(20 * math.log10(255 / levels), abs=1e-5)


@given(st.integers(0, 1 << 30))
def test_metrics_are_symmetric(seed):
    first, second = _make_pair((13, 17), seed)

    assert measure_psnr(first, second) == measure_psnr(second, first)
    assert measure_ssim(first, second) == pytest.approx(measure_ssim(second, first), abs=1e-5)


def test_more_noise_is_farther_from_the_truth():
    noises = [0.01, 0.03, 0.1, 0.3]
    pairs = [_make_pair((40, 40), noise=noise) for noise in noises]

    for measure in (measure_psnr, measure_ssim):
        values = [measure(*pair) for pair in pairs]
        assert values == sorted(values, reverse=True)


def test_pictures_are_not_modified():
    picture, truth = _make_pair((12, 12))
    copies = picture.copy(), truth.copy()
    measure_psnr(picture, truth)
    measure_ssim(picture[::-1], truth[:, ::-1])

    assert np.array_equal(picture, copies[0])
    assert np.array_equal(truth, copies[1])


def test_variants_are_named():
    assert PSNR_VARIANT.startswith("psnr: ")
    assert SSIM_VARIANT.startswith("ssim_inria: ")
