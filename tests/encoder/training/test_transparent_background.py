"""Training separates a subject from a transparent background."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
import torch

from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.description import describe_encode
from quarc_ref.encoder.frames.placement import place_at_errors
from quarc_ref.encoder.segments import slice_capture
from quarc_ref.encoder.training.fixed_scene import FixedScene
from quarc_ref.encoder.training.measurements import measure_error
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.encoder.training.views import TrainingViews
from quarc_ref.evaluation.views import measure_views
from quarc_ref.streams import decode
from tests.encoder.toys import HEIGHT, SMALL, WIDTH, make_context
from tests.encoder.transparent_toys import make_subject, make_subject_capture, render_on

CPU = torch.device("cpu")
CONFIG = replace(
    SMALL,
    canonical=replace(SMALL.canonical, iterations=600, exposure_lr=0.2, exposure_from_iter=10),
    births=replace(SMALL.births, placement="errors", error_threshold=0.02, rd_selection=True),
)


def _make_context(capture=None):
    views = TrainingViews(capture or make_subject_capture(), CPU)
    return replace(make_context(), views=views)


def _encode(capture, frame_count):
    sink = BytesIO()
    encode(capture, sink, EncodeOptions(CONFIG, frame_count, "cpu", checks=False))
    return sink.getvalue()


def test_each_view_has_its_own_background():
    views = TrainingViews(make_subject_capture(), CPU)
    colors = [views.background(view) for view in range(3)]
    for view, color in enumerate(colors):
        corner = views.picture(view, 0)[0, 0]
        assert torch.allclose(corner, color)
        assert torch.equal(color, views.halved().background(view))
        assert all((color - other).abs().max() > 0.2 for other in colors if other is not color)


def test_an_opaque_capture_has_a_black_background():
    context = make_context()
    assert context.views.alpha(0, 0) is None
    assert (context.background(0) == 0).all()


def test_the_pictures_show_the_subject_on_their_background():
    views = TrainingViews(make_subject_capture(), CPU)
    expected, _ = render_on(make_subject(2), views.cameras[1], views.background(1).tolist())
    assert np.abs(views.picture(1, 2).numpy() - expected).max() < 2.1 / 255
    assert views.alpha(1, 2).shape == (HEIGHT, WIDTH, 1)
    assert views.halved().alpha(1, 2).shape == (HEIGHT // 2, WIDTH // 2, 1)


def test_the_true_scene_has_no_error_on_any_exposure():
    context = _make_context()
    context.exposures.gains = torch.tensor([[0.8, 1.0, 1.3], [1.0, 1.0, 1.0], [1.2, 0.9, 0.7]])
    image = context.render(from_splats(make_subject(0), CPU).activated(), 2).image
    background_pixels = (context.views.alpha(2, 0) == 0)[..., 0]
    assert background_pixels.any()
    assert torch.allclose(image[background_pixels], context.truth(2, 0)[background_pixels])


def test_exposures_are_those_of_the_subject():
    context = _make_context()
    wrong_gains = torch.tensor([[0.8], [1.0], [1.2]]).repeat(1, 3)
    context.exposures.gains = wrong_gains

    error = measure_error(context, from_splats(make_subject(0), CPU), fits_exposures=True)

    assert (context.exposures.gains - 1).abs().max() < 0.02
    assert error < 0.01


@pytest.mark.parametrize("opacity_change", [-1, -2])
def test_an_estimate_does_not_depend_on_earlier_gains_which_a_resumed_encode_lacks(opacity_change):
    attributes = from_splats(make_subject(0), CPU)
    attributes = replace(attributes, opacities=attributes.opacities + opacity_change)
    estimates = []
    for gain in (0.93, 1.0):
        context = _make_context()
        gains = [[gain, gain * 1.03, 1.0], [1.0, 1.1, gain], [gain, 0.9, 1.02]]
        context.exposures.gains = torch.tensor(gains)
        measure_error(context, attributes, fits_exposures=True)
        estimates.append(context.exposures.gains)

    assert torch.equal(*estimates)


def test_cameras_that_no_longer_see_the_subject_change_no_exposure():
    context = _make_context(make_subject_capture(seen_by=[1]))
    measure_error(context, from_splats(make_subject(0), CPU), fits_exposures=True)
    assert (context.exposures.gains - 1).abs().max() < 0.02


class _FourPixels:
    """Pictures or alpha of a subject of 2 x 2 pixels, which is darker in camera 1."""

    def __init__(self, source, *, is_alpha):
        self._source, self._is_alpha = source, is_alpha

    def read(self, camera, frame):
        levels = np.zeros_like(self._source(camera, frame))
        gain = 0.7 if camera == 1 and not self._is_alpha else 1.0
        block = np.s_[17:19, 25:27]
        levels[block] = np.round(self._source(camera, frame)[block] * gain)
        return levels


def test_exposures_of_a_tiny_subject_are_those_of_its_pixels():
    capture = make_subject_capture()
    tiny = Capture(
        "tiny", capture.cameras, 1, 30.0, capture.points,
        _FourPixels(capture.image, is_alpha=False), "0" * 64,
        alphas=_FourPixels(capture.alpha, is_alpha=True),
    )  # fmt: skip
    context = _make_context(tiny)

    measure_error(context, from_splats(make_subject(0), CPU), fits_exposures=True)

    expected = torch.tensor([[0.7], [1.0], [1.0]]).repeat(1, 3)
    assert torch.allclose(context.exposures.gains, expected, atol=0.03)


def test_a_part_of_a_capture_has_the_alpha_of_its_frames():
    capture = make_subject_capture(4)
    part = slice_capture(capture, 2, 2)
    assert np.array_equal(part.alpha(1, 1), capture.alpha(1, 3))
    assert not np.array_equal(part.alpha(1, 1), capture.alpha(1, 1))


def test_births_lie_on_the_subject_whatever_the_background():
    context = _make_context()
    scene = FixedScene(context, from_splats(make_subject(0), CPU))
    settings = replace(CONFIG.births, max_births=100)
    births, _ = place_at_errors(context, scene, frame=3, settings=settings)
    assert len(births.means) > 3
    assert births.means.abs().max() < 0.7  # as that of the Gaussians


@pytest.fixture(scope="module")
def scenes_by_alpha():
    return {
        has_alpha: list(decode(_encode(make_subject_capture(3, has_alpha=has_alpha), 3)))
        for has_alpha in (False, True)
    }


@pytest.mark.parametrize("frame", [0, 2])
def test_only_the_subject_covers_another_background(scenes_by_alpha, frame):
    capture = make_subject_capture()
    errors = {}
    for has_alpha, scenes in scenes_by_alpha.items():
        squared_errors = []
        for camera in capture.cameras:
            white = (1.0, 1.0, 1.0)
            truth, _ = render_on(make_subject(frame), camera, white)
            image, _ = render_on(dequantize(scenes[frame]), camera, white)
            squared_errors.append(np.square(image - truth).mean())
        errors[has_alpha] = np.mean(squared_errors)
    assert errors[True] < 0.7 * errors[False]


def test_only_what_truth_or_rendering_cover_is_measured():
    capture = make_subject_capture()
    camera = capture.cameras[0]
    rendering, _ = render_on(make_subject(1), camera, (0.0, 0.0, 0.0))
    (view,) = measure_views(make_subject(1), 0, capture.cameras, capture)

    truth = capture.image(0, 0) / np.float32(255)
    is_covered = (capture.alpha(0, 0) > 0) | (rendering > 0.5 / 255).any(axis=2)
    assert 0.1 < is_covered.mean() < 0.9
    error = np.square(rendering - truth)[is_covered].mean()
    assert view.psnr == pytest.approx(-10 * np.log10(error), abs=0.01)
    assert np.array_equal(view.mask, is_covered)


def test_the_stream_states_that_its_background_is_transparent():
    metadata = describe_encode(make_subject_capture(), CONFIG, "cpu")
    assert metadata["background"] == "transparent"
    assert "background" not in describe_encode(make_subject_capture(has_alpha=False), CONFIG, "cpu")
