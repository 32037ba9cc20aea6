import io
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.decoder import dequantize
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.training.exposure import Exposures, estimate_gain
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.streams import decode
from tests.encoder.toys import SMALL, make_capture

_CPU = torch.device("cpu")
_GAINS = np.array([1.0, 1.25, 0.8, 1.0])


def _make_image(seed=0):
    return torch.rand(12, 16, 3, generator=torch.Generator().manual_seed(seed)) * 0.6


@given(st.tuples(*[st.floats(0.55, 1.5)] * 3))
def test_a_gain_is_the_factor_that_an_image_was_multiplied_by(factors):
    gain = estimate_gain(_make_image(), _make_image() * torch.tensor(factors))

    assert torch.allclose(gain, torch.tensor(factors), rtol=1e-4)


def test_saturated_pixels_are_ignored():
    image, picture = _make_image(), _make_image() * 1.2
    picture[:5] = 1.0

    assert torch.allclose(estimate_gain(image, picture), torch.tensor(1.2), rtol=1e-4)


def test_a_black_image_gives_no_gain():
    assert torch.equal(estimate_gain(torch.zeros(4, 4, 3), _make_image()[:4, :4]), torch.ones(3))


def test_gains_are_bounded():
    assert torch.equal(estimate_gain(_make_image(), _make_image() * 1e-3), torch.full((3,), 0.5))


@pytest.mark.parametrize("has_initial_estimate", [False, True])
def test_the_gains_of_the_views_are_found_and_their_median_is_one(has_initial_estimate):
    exposures = Exposures(3, _CPU)
    gains = torch.tensor([0.9, 1.0, 1.4])
    pairs = [(_make_image(view), _make_image(view) * gain) for view, gain in enumerate(gains)]

    if has_initial_estimate:
        exposures.estimate_all(iter(pairs))
    for _ in range(60):
        for view, (image, picture) in enumerate(pairs):
            exposures.update_gain(view, image, picture, weight=0.2)

    assert torch.allclose(exposures.gains, gains[:, None].expand(3, 3), atol=2e-3)
    assert torch.allclose(exposures.gains.median(dim=0).values, torch.ones(3))
    corrected = exposures.correct(pairs[2][1], 2)
    assert torch.allclose(corrected, pairs[2][0], atol=2e-3)


def test_a_corrected_picture_is_kept_until_the_gains_change():
    exposures, picture = Exposures(2, _CPU), _make_image()
    corrected = exposures.correct(picture, 1)

    assert exposures.correct(picture, 1) is corrected
    exposures.update_gain(0, picture, picture * 0.8, weight=1.0)
    assert torch.allclose(exposures.correct(picture, 1), picture / exposures.gains[1])
    assert not torch.equal(exposures.correct(picture, 1), corrected)


class _UnevenSource:
    """A picture source that multiplies the pictures of each camera by a different gain."""

    def __init__(self, source):
        self._source = source

    def read(self, camera: int, frame: int) -> np.ndarray:
        picture = self._source.read(camera, frame) * 0.6 * _GAINS[camera]
        return np.clip(np.round(picture), 0, 255).astype(np.uint8)


def _held_out_error(exposure_rate):
    capture = make_capture(1)
    capture._source = _UnevenSource(capture._source)
    canonical = replace(
        SMALL.canonical, iterations=150, exposure_lr=exposure_rate, exposure_from_iter=30
    )
    sink = io.BytesIO()
    encode(capture, sink, EncodeOptions(replace(SMALL, canonical=canonical), 1, "cpu"))
    (scene,) = decode(sink.getvalue())
    picture = np.clip(render_picture(dequantize(scene), capture.cameras[0]), 0, 1)
    return float(np.square(picture - capture.image(0, 0) / 255).mean())


def test_correcting_gains_of_uneven_cameras_helps_the_held_out_view():
    assert _held_out_error(0.2) < 0.9 * _held_out_error(0.0)
