import io
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.decoder import dequantize
from quarc_ref.encoder import EncodeOptions, encode, encode_stream
from quarc_ref.encoder.frames.motion import fit_motion
from quarc_ref.encoder.training.exposure import Exposures, estimate_gain, estimate_median_gain
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.streams import decode
from tests.encoder.toys import SMALL, make_capture

_CPU = torch.device("cpu")
_GAINS = np.array([1.0, 1.25, 0.8, 1.0])


def _make_image(seed=0):
    return torch.rand(12, 16, 3, generator=torch.Generator().manual_seed(seed)) * 0.6


_for_each_estimator = pytest.mark.parametrize("estimate", [estimate_gain, estimate_median_gain])


@_for_each_estimator
@given(factors=st.tuples(*[st.floats(0.55, 1.5)] * 3))
def test_a_gain_is_the_factor_that_an_image_was_multiplied_by(estimate, factors):
    gain = estimate(_make_image(), _make_image() * torch.tensor(factors))

    assert torch.allclose(gain, torch.tensor(factors), rtol=1e-4)


@_for_each_estimator
def test_saturated_pixels_are_ignored(estimate):
    image, picture = _make_image(), _make_image() * 1.2
    picture[:5] = 1.0

    assert torch.allclose(estimate(image, picture), torch.tensor(1.2), rtol=1e-4)


@pytest.mark.parametrize(
    ("image", "picture"),
    [
        (torch.zeros(12, 16, 3), _make_image()),
        (_make_image(), torch.ones(12, 16, 3)),
        (torch.zeros(0, 3), torch.zeros(0, 3)),
    ],
    ids=["black image", "white picture", "no pixels"],
)
def test_without_evidence_there_is_no_gain(image, picture):
    assert torch.equal(estimate_gain(image, picture), torch.ones(3))
    assert torch.isnan(estimate_median_gain(image, picture)).all()


@_for_each_estimator
def test_gains_are_bounded(estimate):
    assert torch.equal(estimate(_make_image(), _make_image() * 1e-3), torch.full((3,), 0.5))


@given(st.integers(0, 4), st.floats(0, 0.9))
def test_parts_that_have_changed_do_not_change_a_median_gain(row, level):
    image = torch.full((20, 16, 3), 0.5)
    picture = image * 1.2
    picture[4 * row : 4 * row + 4] = level

    assert torch.allclose(estimate_median_gain(image, picture), torch.tensor(1.2), rtol=1e-4)


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


def test_gains_follow_changes_that_are_no_errors_of_the_estimate():
    exposures, image = Exposures(4, _CPU), _make_image()
    gains, changes = torch.tensor([0.9, 1.0, 1.1, 1.0]), torch.tensor([1.004, 1.0, 1.2, 0.997])
    exposures.estimate_all((image, image * gain) for gain in gains)
    first_gains = exposures.gains

    for _ in range(2):  # a change does not depend on those before it
        exposures.follow((image, image * gain) for gain in gains * changes)

    expected = torch.tensor([1.0, 1.0, 1.2 / 1.01, 1.0])
    assert torch.allclose(exposures.gains / first_gains, expected[:, None], rtol=3e-3)
    assert torch.equal(exposures.gains[0], first_gains[0])


def test_a_gain_that_cannot_be_estimated_keeps_its_first_value():
    image, black = _make_image(), torch.zeros(12, 16, 3)
    exposures = Exposures(4, _CPU)

    exposures.estimate_all((image, image * gain) for gain in (0.8, 0.9, 0.9, 1.2))
    first_gains = exposures.gains
    exposures.follow(
        (image, picture) for picture in (torch.ones(12, 16, 3), *(image * g for g in (1, 1, 1.2)))
    )

    assert torch.equal(exposures.gains[0], first_gains[0])
    exposures.estimate_all((black, image) for _ in range(4))
    assert torch.equal(exposures.gains, torch.ones(4, 3))


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


class _DarkeningSource:
    """A picture source whose last camera takes darker pictures from frame to frame."""

    def __init__(self, source):
        self._source = source

    def read(self, camera: int, frame: int) -> np.ndarray:
        picture = self._source.read(camera, frame)
        return np.round(picture * (1 - 0.1 * frame if camera == 3 else 1)).astype(np.uint8)


@pytest.mark.parametrize("follows", [False, True])
def test_the_gains_of_later_frames_follow_exposures_if_they_are_to(follows, monkeypatch):
    gains = []

    def record_gains(context, *arguments):
        gains.append(context.exposures.gains[-1].clone())
        return fit_motion(context, *arguments)

    monkeypatch.setattr(encode_stream, "fit_motion", record_gains)
    capture = make_capture(4)
    capture._source = _DarkeningSource(capture._source)
    config = replace(
        SMALL,
        canonical=replace(SMALL.canonical, exposure_lr=0.2, exposure_from_iter=90),
        motion=replace(SMALL.motion, follow_exposures=follows),
    )

    encode(capture, io.BytesIO(), EncodeOptions(config, 4, "cpu"))

    changes = torch.stack(gains) / gains[0]
    expected = torch.tensor([0.9, 0.8, 0.7]) / 0.9 if follows else torch.ones(3)
    assert torch.allclose(changes, expected[:, None].expand(3, 3), atol=0.03)
