import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quarc_ref.evaluation.color_correction import (
    COLOR_CORRECTION,
    GAIN_CORRECTION,
    correct_color,
    correct_gain,
)
from quarc_ref.evaluation.metrics import MAX_DECIBELS, measure_psnr

PICTURES = arrays(np.float32, (4, 5, 3), elements=st.floats(0, 1, width=32))
CORRECTIONS = pytest.mark.parametrize("correct", [correct_color, correct_gain])


def _make_truth(seed=0, size=(12, 16)):
    return np.random.default_rng(seed).uniform(0.3, 0.7, (*size, 3)).astype(np.float32)


@given(
    seed=st.integers(0, 99),
    gains=st.lists(st.floats(0.7, 1.2), min_size=3, max_size=3),
    crosstalk=st.floats(-0.08, 0.08),
    offset=st.floats(-0.03, 0.03),
)
def test_a_truth_with_other_exposure_and_colors_is_corrected_perfectly(
    seed, gains, crosstalk, offset
):
    truth = _make_truth(seed)
    color_matrix = np.diag(gains) + crosstalk * (1 - np.eye(3))
    picture = np.clip(truth @ color_matrix + offset, 0, 1).astype(np.float32)

    assert measure_psnr(correct_color(picture, truth), truth) == MAX_DECIBELS


@given(gains=st.lists(st.floats(0.5, 1.2), min_size=3, max_size=3))
def test_a_truth_with_other_exposure_is_corrected_perfectly_by_gains(gains):
    truth = _make_truth()
    picture = (truth * gains).astype(np.float32)

    assert measure_psnr(correct_gain(picture, truth), truth) == MAX_DECIBELS


@CORRECTIONS
@given(picture=PICTURES, truth=PICTURES)
def test_no_correction_makes_a_picture_worse(correct, picture, truth):
    corrected = correct(picture, truth)

    errors = [np.square(image.astype(float) - truth).mean() for image in (corrected, picture)]
    assert errors[0] <= errors[1] + 1e-9
    assert corrected.dtype == np.float32
    assert corrected.shape == picture.shape
    assert corrected.min() >= 0
    assert corrected.max() <= 1


@CORRECTIONS
def test_missing_values_stay_missing(correct):
    truth = _make_truth()
    blurred = np.full_like(truth, 0.5)
    blurred[::2] = 0.4

    assert measure_psnr(correct(blurred, truth), truth) < 20


@CORRECTIONS
def test_a_black_picture_is_corrected_without_error(correct):
    assert np.isfinite(correct(np.zeros_like(_make_truth()), _make_truth())).all()


def test_a_correction_is_named_after_what_it_does():
    assert (COLOR_CORRECTION.prefix, GAIN_CORRECTION.prefix) == ("cc", "gain")
    picture, truth = _make_truth(1), _make_truth(2)
    assert np.array_equal(COLOR_CORRECTION.apply(picture, truth), correct_color(picture, truth))
    assert np.array_equal(GAIN_CORRECTION.apply(picture, truth), correct_gain(picture, truth))
