import numpy as np
import pytest

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.rendering import bands
from quarc_ref.rendering.bands import draw_bands
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.rendering.pipeline import (
    bin_tiles,
    blank_picture,
    composite,
    list_pairs,
    project,
    sort_nearest,
)
from quarc_ref.rendering.pipeline_data import SplatRows
from tests.rendering.scenes import make_camera


def _make_drawn(count, size, seed=0):
    """Gaussians in front of the camera, some of them outside the picture."""
    rng = np.random.default_rng(seed)
    arrays = (
        rng.normal(size=(count, 3)) * [1.5, 1, 1] + [-1, 0, 4],
        rng.normal(size=(count, 4)),
        np.exp(rng.normal(size=(count, 3)) * 0.5) * size,
        rng.uniform(0.01, 0.99, count),
        rng.normal(size=(count, 4, 3)) * 0.4,
    )
    return SplatRows(*(array.astype(np.float32) for array in arrays))


def _draw_at_once(camera, drawn):
    projection, picture = project(camera, drawn), blank_picture(camera)
    composite(projection, bin_tiles(camera, projection), np.zeros(3, np.float32), picture)
    return picture.image


def _draw_in_bands(camera, drawn):
    projection = project(camera, drawn)
    nearest_first = projection.take(sort_nearest(projection))
    return np.concatenate([band.image for band in draw_bands(nearest_first, camera)])


@pytest.fixture
def pairs(monkeypatch):
    """Numbers of Gaussians and pairs in each list."""
    seen = []

    def list_and_count(projection, order, band, counts):
        seen.append((order.size, int(counts.sum())))
        return list_pairs(projection, order, band, counts)

    monkeypatch.setattr(bands, "list_pairs", list_and_count)
    return seen


@pytest.mark.parametrize("band_pixels", [1, 1 << 12, 1 << 21])
@pytest.mark.parametrize("slice_pairs", [0, 1, 50, 1 << 22])
@pytest.mark.parametrize("size", [(100, 60), (1, 700), (700, 1), (33, 17)])
@pytest.mark.parametrize("scale", [0.02, 0.5])
def test_bands_and_slices_give_the_same_picture(band_pixels, slice_pairs, size, scale, monkeypatch):
    camera, drawn = make_camera(*size), _make_drawn(300, scale)
    monkeypatch.setattr(bands, "BAND_PIXELS", band_pixels)
    monkeypatch.setattr(bands, "SLICE_PAIRS", slice_pairs)

    picture = _draw_in_bands(camera, drawn)

    assert np.array_equal(picture, _draw_at_once(camera, drawn))
    assert picture.max() > 0


def test_lists_have_at_most_the_pairs_of_a_slice(pairs, monkeypatch):
    monkeypatch.setattr(bands, "SLICE_PAIRS", 100)
    _draw_in_bands(make_camera(160, 96), _make_drawn(500, 0.1))

    assert len(pairs) > 3
    assert max(count for _, count in pairs) <= 100


def test_a_gaussian_with_too_many_pairs_is_its_own_slice(pairs, monkeypatch):
    monkeypatch.setattr(bands, "SLICE_PAIRS", 10)
    drawn = _make_drawn(6, 0.1)
    drawn.scales[:] = 100
    _draw_in_bands(make_camera(160, 96), drawn)

    assert set(pairs) == {(1, 60)}


def test_gaussians_behind_saturated_pixels_are_not_listed(pairs, monkeypatch):
    monkeypatch.setattr(bands, "SLICE_PAIRS", 600)
    drawn = _make_drawn(1000, 0.1)
    drawn.scales[:] = 100
    drawn.opacities[:] = 0.9
    _draw_in_bands(make_camera(160, 96), drawn)

    assert pairs == [(10, 600)]


def test_a_picture_without_gaussians_is_black():
    camera, drawn = make_camera(50, 40), _make_drawn(5, 0.1)
    drawn.means[:, 2] = -5

    assert not _draw_in_bands(camera, drawn).any()


@pytest.mark.parametrize("coefficients", [1, 4])
def test_a_stream_without_view_dependent_color_can_be_rendered(coefficients):
    rng = np.random.default_rng(0)
    shapes = ((30, 3), (30, 4), (30, 3), (30,), (30, coefficients, 3))
    splats = Splats(*(rng.normal(size=shape).astype(np.float32) for shape in shapes))

    assert render_picture(splats, make_camera(40, 30)).shape == (30, 40, 3)
