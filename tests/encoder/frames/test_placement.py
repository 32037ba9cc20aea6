from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.encoder.frames.placement import filter_maximum, find_nearest, place_at_errors
from quarc_ref.encoder.settings.frames import BirthSettings
from quarc_ref.encoder.training.fixed_scene import FixedScene
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.rendering.pictures import render_picture
from tests.encoder.toys import HEIGHT, WIDTH, make_context, make_splats

_CPU = torch.device("cpu")
_BLOB_POSITION = np.array([0.2, -0.1, -1.2], dtype=np.float32)
_SETTINGS = BirthSettings(
    placement="errors", error_threshold=0.05, max_births=40, opacity_logit=0.0
)
_SH_C0 = 0.28209479177387814


def _add_red_blob(splats: Splats) -> Splats:
    """Return the scene with an additional opaque red Gaussian in front."""
    red = np.array([[[0.9, 0.1, 0.1]]], dtype=np.float32)
    return Splats(
        np.concatenate([splats.positions, _BLOB_POSITION[None]]),
        np.concatenate([splats.rotations, splats.rotations[:1]]),
        np.concatenate([splats.log_scales, np.full((1, 3), np.log(0.1), dtype=np.float32)]),
        np.concatenate([splats.opacities, np.full(1, 6.0, dtype=np.float32)]),
        np.concatenate([splats.sh, (red - 0.5) / np.float32(_SH_C0)]),
    )


@pytest.fixture
def context(monkeypatch):
    """A training context whose ground truth is frame 0 with an additional red Gaussian."""
    context = make_context()
    changed = _add_red_blob(make_splats(0))

    def truth(_, view: int, frame: int) -> torch.Tensor:
        del frame
        return torch.from_numpy(np.clip(render_picture(changed, context.camera(view)), 0, 1))

    monkeypatch.setattr(type(context), "truth", truth)
    return context


def test_births_start_at_wrong_pixels_with_the_color_of_the_truth(context):
    scene = FixedScene(context, from_splats(make_splats(0), _CPU))

    new_attributes, parents = place_at_errors(context, scene, frame=1, settings=_SETTINGS)

    colors = 0.5 + _SH_C0 * new_attributes.sh_dc[:, 0].numpy()
    is_red = colors[:, 0] > colors[:, 1:].max(axis=1) + 0.25
    assert 1 <= parents.numel() <= _SETTINGS.max_births
    assert is_red.mean() > 0.8
    cameras = [context.camera(view) for view in range(len(context.views.cameras))]
    distances_by_camera = [
        _measure_pixel_distances(camera, new_attributes.means.numpy(), _BLOB_POSITION)
        for camera in cameras
    ]
    assert np.max(np.min(distances_by_camera, axis=0)) < 4


@pytest.mark.parametrize("gain", [0.8, 1.0, 1.2])
def test_overexposed_pixels_are_no_errors(context, monkeypatch, gain):
    context.exposures.gains[:] = gain
    white = torch.full((HEIGHT, WIDTH, 3), 1 / gain)
    monkeypatch.setattr(type(context), "truth", lambda *_: white)
    splats = make_splats(0)
    bright = replace(splats, sh=splats.sh + 10)
    scene = FixedScene(context, from_splats(bright, _CPU))

    _, parents = place_at_errors(context, scene, frame=1, settings=_SETTINGS)

    assert parents.numel() == 0


def test_births_lie_on_the_visible_surface(context):
    scene = FixedScene(context, from_splats(make_splats(0), _CPU))

    new_attributes, _ = place_at_errors(context, scene, frame=1, settings=_SETTINGS)

    depths = new_attributes.means[:, 2].numpy()
    assert depths.min() > -0.8
    assert depths.max() < 1.3


def test_the_worst_pixels_come_first_up_to_the_limit(context):
    scene = FixedScene(context, from_splats(make_splats(0), _CPU))

    many, _ = place_at_errors(context, scene, frame=1, settings=_SETTINGS)
    few, _ = place_at_errors(context, scene, frame=1, settings=replace(_SETTINGS, max_births=4))

    assert torch.equal(few.means, many.means[:4])


def test_a_correct_picture_gets_no_births(context):
    scene = FixedScene(context, from_splats(_add_red_blob(make_splats(0)), _CPU))

    _, parents = place_at_errors(context, scene, frame=1, settings=_SETTINGS)

    assert parents.numel() == 0


@given(st.integers(1, 60), st.integers(0, 20), st.integers(0, 1000))
def test_the_nearest_neighbor_is_found(scene_count, place_count, seed):
    rng = np.random.default_rng(seed)
    scene = torch.from_numpy(rng.normal(size=(scene_count, 3)).astype(np.float32))
    places = torch.from_numpy(rng.normal(size=(place_count, 3)).astype(np.float32))

    nearest = find_nearest(scene, places)

    assert nearest.shape == (place_count,)
    distances = torch.cdist(places.double(), scene.double())
    if place_count:
        chosen = distances[torch.arange(place_count), nearest]
        assert torch.allclose(chosen, distances.min(dim=1).values)


def _measure_pixel_distances(camera, places: np.ndarray, center: np.ndarray) -> np.ndarray:
    """Return the distances of projected positions from a projected center, pixels."""
    rotation = np.array(camera.rotation).reshape(3, 3)
    points = [p @ rotation.T + np.array(camera.translation) for p in (places, center[None])]
    first, second = (point[:, :2] / point[:, 2:] * camera.fx for point in points)
    return np.linalg.norm(first - second, axis=1)


@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 3), st.integers(0, 1 << 30))
def test_the_maximum_is_that_of_the_window(rows, columns, reach, seed):
    numbers = torch.rand((rows, columns), generator=torch.Generator().manual_seed(seed))

    expected = torch.nn.functional.max_pool2d(
        numbers[None, None], 2 * reach + 1, stride=1, padding=reach
    )
    assert torch.equal(filter_maximum(numbers, reach), expected[0, 0])


@pytest.mark.parametrize("radius", [4, 5, 1 << 40])
def test_a_square_wider_than_the_image_has_its_maximum(radius):
    numbers = torch.rand((3, 5), generator=torch.Generator().manual_seed(0))

    assert torch.equal(filter_maximum(numbers, radius), numbers.max().expand(3, 5))
