import numpy as np
import pytest

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.rendering import bands
from quarc_ref.rendering.bands import render_band_pictures
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.rendering.pipeline import (
    bin_band,
    bin_tiles,
    composite,
    make_blank_picture,
    project,
    sort_by_depth,
)
from quarc_ref.rendering.pipeline_data import SplatRows
from tests.rendering.scenes import make_camera


def _make_gaussians(count, size, seed=0):
    """Return Gaussians in front of the camera; some of them are outside the picture."""
    rng = np.random.default_rng(seed)
    arrays = (
        rng.normal(size=(count, 3)) * [1.5, 1, 1] + [-1, 0, 4],
        rng.normal(size=(count, 4)),
        np.exp(rng.normal(size=(count, 3)) * 0.5) * size,
        rng.uniform(0.01, 0.99, count),
        rng.normal(size=(count, 4, 3)) * 0.4,
    )
    return SplatRows(*(array.astype(np.float32) for array in arrays))


def _render_at_once(camera, gaussians):
    projection, picture = project(camera, gaussians), make_blank_picture(camera)
    composite(projection, bin_tiles(camera, projection), np.zeros(3, np.float32), picture)
    return picture.image


def _render_in_bands(camera, gaussians):
    projection = project(camera, gaussians)
    sorted_projection = projection.take(sort_by_depth(projection))
    return np.concatenate([band.image for band in render_band_pictures(sorted_projection, camera)])


@pytest.fixture
def list_sizes(monkeypatch):
    """A list to which every call of `bin_band` adds its numbers of Gaussians and pairs."""
    sizes = []

    def list_and_count(projection, order, band, counts):
        sizes.append((order.size, int(counts.sum())))
        return bin_band(projection, order, band, counts)

    monkeypatch.setattr(bands, "bin_band", list_and_count)
    return sizes


@pytest.mark.parametrize("band_pixels", [1, 1 << 12, 1 << 21])
@pytest.mark.parametrize("slice_pairs", [0, 50, 1 << 22])
@pytest.mark.parametrize("size", [(100, 60), (1, 700), (700, 1), (33, 17)])
@pytest.mark.parametrize("scale", [0.02, 0.5])
def test_bands_and_slices_give_the_same_picture(band_pixels, slice_pairs, size, scale, monkeypatch):
    camera, gaussians = make_camera(*size), _make_gaussians(100, scale)
    monkeypatch.setattr(bands, "MAX_BAND_PIXELS", band_pixels)
    monkeypatch.setattr(bands, "MAX_SLICE_PAIRS", slice_pairs)

    picture = _render_in_bands(camera, gaussians)

    assert np.array_equal(picture, _render_at_once(camera, gaussians))
    assert picture.max() > 0


def test_lists_have_at_most_the_pairs_of_a_slice(list_sizes, monkeypatch):
    monkeypatch.setattr(bands, "MAX_SLICE_PAIRS", 100)
    _render_in_bands(make_camera(160, 96), _make_gaussians(500, 0.1))

    assert len(list_sizes) > 3
    assert max(count for _, count in list_sizes) <= 100


def test_a_gaussian_with_too_many_pairs_is_its_own_slice(list_sizes, monkeypatch):
    monkeypatch.setattr(bands, "MAX_SLICE_PAIRS", 10)
    gaussians = _make_gaussians(6, 0.1)
    gaussians.scales[:] = 100
    _render_in_bands(make_camera(160, 96), gaussians)

    assert set(list_sizes) == {(1, 60)}


def test_gaussians_behind_saturated_pixels_are_not_listed(list_sizes, monkeypatch):
    monkeypatch.setattr(bands, "MAX_SLICE_PAIRS", 600)
    gaussians = _make_gaussians(1000, 0.1)
    gaussians.scales[:] = 100
    gaussians.opacities[:] = 0.9
    _render_in_bands(make_camera(160, 96), gaussians)

    assert list_sizes == [(10, 600)]


def test_a_picture_without_gaussians_is_black():
    camera, gaussians = make_camera(50, 40), _make_gaussians(5, 0.1)
    gaussians.means[:, 2] = -5

    assert not _render_in_bands(camera, gaussians).any()


@pytest.mark.parametrize("coefficients", [1, 4])
def test_a_stream_without_view_dependent_color_can_be_rendered(coefficients):
    rng = np.random.default_rng(0)
    shapes = ((30, 3), (30, 4), (30, 3), (30,), (30, coefficients, 3))
    splats = Splats(*(rng.normal(size=shape).astype(np.float32) for shape in shapes))

    assert render_picture(splats, make_camera(40, 30)).shape == (30, 40, 3)
