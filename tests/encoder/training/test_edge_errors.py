import math
from types import SimpleNamespace

import pytest
import torch

from quarc_ref.encoder.training import measurements
from quarc_ref.rendering.rasterizer import Rendering
from tests.encoder.toys import make_context


@pytest.fixture
def context(monkeypatch):
    """A context whose views are rendered as their own pictures of frame 1."""
    context = make_context()

    def render(context, *_):
        for view in range(context.view_count):
            image = context.views.picture(view, 1)
            yield Rendering(image, image[..., 0], torch.zeros(1, 2), torch.zeros(1))

    monkeypatch.setattr(measurements, "_render", render)
    monkeypatch.setattr(measurements, "from_splats", lambda *_: None)
    monkeypatch.setattr(measurements, "dequantize", lambda _: None)
    return context


_STATE = SimpleNamespace(scene=SimpleNamespace(frame=1))


def _replace_picture(context, view, change):
    context.views._pictures[view, 2] = change(context.views.picture(view, 1))
    for other in range(context.view_count):
        if other != view:
            context.views._pictures[other, 2] = context.views.picture(other, 1)


def _measure(context, change):
    measurements.refit_exposures(context, _STATE)
    _replace_picture(context, 1, change)
    return measurements.follow_exposures(context, _STATE, 2)


def test_equal_pictures_have_no_error(context):
    assert _measure(context, torch.clone) == pytest.approx([0, 0, 0], abs=1e-6)


def test_a_shifted_picture_has_a_large_error_at_edges(context):
    errors = _measure(context, lambda picture: picture.roll(2, dims=1))

    assert errors[0] == pytest.approx(0, abs=1e-6)
    assert errors[1] > 0.05


def test_an_object_that_moves_hardly_changes_the_error(context):
    def cover(picture):
        covered = picture.clone()
        covered[10:26, 10:26] = 0.5  # a seventh of the picture
        return covered

    assert max(_measure(context, cover)) < 0.01


def test_a_brighter_picture_has_no_error(context):
    assert max(_measure(context, lambda picture: 0.8 * picture)) < 0.01


def test_masked_pixels_are_left_out(context):
    mask = torch.ones(36, 48, 1)
    mask[:, 20:] = 0
    context.views._masks[1, 2] = mask

    def damage(picture):
        damaged = picture * mask
        damaged[:, 20:] = 1.0
        return damaged

    assert max(_measure(context, damage)) < 0.01
    context.views._masks[1, 2] = torch.zeros(36, 48, 1)
    measurements.refit_exposures(context, _STATE)
    errors = measurements.follow_exposures(context, _STATE, 2)
    assert [math.isnan(error) for error in errors] == [False, True, False]
