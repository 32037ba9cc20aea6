"""Pseudo-views: cameras between the training cameras, and training on an ensemble's pictures."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.datasets.camera_geometry import camera_center, rotation_matrix
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.canonical import train_canonical
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.context import Observers
from quarc_ref.encoder.training.initialization import initialize_from_points
from quarc_ref.encoder.training.pseudo_views import PseudoViews, interpolate_cameras
from quarc_ref.format.records import StreamHeader
from quarc_ref.rendering.raster_numba import NumbaRasterizer
from tests.encoder.toys import HEIGHT, SMALL, WIDTH, make_cameras, make_capture, make_context

_ENSEMBLE = replace(
    SMALL.canonical, iterations=40, densify_until_iter=30, ensemble_size=3, pseudo_views_from=0.25,
    pseudo_view_ratio=0.5,
)  # fmt: skip
_START = 10  # a quarter of the iterations
_REST = 10  # iterations after densification


class _CountingRasterizer(NumbaRasterizer):
    """A rasterizer that counts the pictures that are needed for training."""

    def __init__(self):
        super().__init__()
        self.trained_cameras = []

    def render(self, gaussians, camera, background):
        if gaussians.means.requires_grad:
            self.trained_cameras.append(camera)
        return super().render(gaussians, camera, background)


def _draw(views, seed=0):
    return views.draw(torch.Generator().manual_seed(seed))


def _make_scenes(*brightness):
    points = make_capture().points
    generator = torch.Generator().manual_seed(0)
    scene = initialize_from_points(points, SMALL.canonical, generator, torch.device("cpu"))
    return [replace(scene, sh_dc=scene.sh_dc + offset) for offset in brightness]


def _render(scene):
    """Render a scene for the first pseudo-view."""
    return _draw(PseudoViews([scene], make_cameras()[1:], 1, NumbaRasterizer())).picture


def _train(settings, context=None):
    objective = CanonicalObjective(settings, StreamHeader())
    return train_canonical(context or make_context(), make_capture().points, objective)


@given(st.floats(0, 1))
def test_a_camera_is_on_the_line_between_two_others(position):
    first, second = make_cameras()[1:3]
    camera = interpolate_cameras(first, second, position)

    expected = (1 - position) * camera_center(first) + position * camera_center(second)
    assert camera_center(camera) == pytest.approx(expected, abs=1e-9)
    angles = [
        np.arccos(np.clip((np.trace(rotation_matrix(a).T @ rotation_matrix(b)) - 1) / 2, -1, 1))
        for a, b in ((first, camera), (first, second))
    ]
    assert angles[0] == pytest.approx(position * angles[1], abs=1e-6)
    assert (camera.fx, camera.width, camera.near) == (first.fx, first.width, first.near)


def test_a_picture_is_the_median_of_the_scenes_at_the_reduced_size():
    cameras = make_cameras()
    scenes = _make_scenes(0.0, 0.3, 5.0)
    full, half = (PseudoViews(scenes, cameras, n, NumbaRasterizer()) for n in (1, 2))
    middle = PseudoViews(scenes[1:2], cameras, 1, NumbaRasterizer())

    assert torch.equal(_draw(full).picture, _draw(middle).picture)
    assert _draw(full).picture.shape == (HEIGHT, WIDTH, 3)
    assert _draw(half).picture.shape == (HEIGHT // 2, WIDTH // 2, 3)
    assert _draw(half).camera == _draw(full).camera


def test_two_scenes_are_averaged():
    cameras = make_cameras()
    both, *single = (
        _draw(PseudoViews(scenes, cameras, 1, NumbaRasterizer())).picture
        for scenes in (_make_scenes(0.0, 0.3), _make_scenes(0.0), _make_scenes(0.3))
    )

    assert torch.allclose(both, (single[0] + single[1]) / 2, atol=1e-6)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_views_of_any_number_of_cameras_are_between_them(count):
    cameras = make_cameras(count)
    views = PseudoViews(_make_scenes(0.0), cameras, 1, NumbaRasterizer())
    centers = np.array([camera_center(camera) for camera in cameras])
    for seed in range(20):
        center = camera_center(_draw(views, seed).camera)
        assert (center >= centers.min(axis=0) - 1e-9).all()
        assert (center <= centers.max(axis=0) + 1e-9).all()


def test_the_scenes_of_an_ensemble_are_trained_one_after_the_other():
    steps, advances = [], []
    context = make_context()
    rasterizer = _CountingRasterizer()

    class _Recorder:
        def advance(self, _stage, done, total):
            advances.append((done, total))

        def step(self, step):
            steps.append((step.step, step.steps))

    context = replace(context, rasterizer=rasterizer, observers=Observers(_Recorder(), _Recorder()))
    _train(_ENSEMBLE, context)

    total = 2 * _START + _ENSEMBLE.iterations
    assert _ENSEMBLE.training_steps == total
    assert advances == [(step, total) for step in range(1, total + 1)]
    training_cameras = set(context.views.cameras)
    uses_pseudo_view = [camera not in training_cameras for camera in rasterizer.trained_cameras]
    assert not any(uses_pseudo_view[: 3 * _START])
    pseudo_count = sum(uses_pseudo_view)
    assert 3 < pseudo_count < 17  # about half of 20 iterations
    assert not any(uses_pseudo_view[-_REST:])
    assert len(uses_pseudo_view) == total + pseudo_count
    assert steps == advances


def test_with_a_ratio_of_one_every_iteration_until_densification_ends_uses_a_pseudo_view():
    rasterizer = _CountingRasterizer()
    context = replace(make_context(), rasterizer=rasterizer)
    _train(replace(_ENSEMBLE, pseudo_view_ratio=1.0), context)

    training_cameras = set(context.views.cameras)
    pairs_start, pairs_end = 3 * _START, _ENSEMBLE.training_steps - _REST
    assert [camera in training_cameras for camera in rasterizer.trained_cameras] == (
        [True] * pairs_start + [True, False] * (pairs_end - pairs_start) + [True] * _REST
    )


def test_training_on_pseudo_views_approaches_them():
    settings = replace(_ENSEMBLE, pseudo_view_ratio=1.0, ensemble_size=2, densify_until_iter=40)
    trained = _train(settings)
    points = make_capture().points
    initial = initialize_from_points(
        points, settings, torch.Generator().manual_seed(0), torch.device("cpu")
    )
    truth = _render(_train(replace(SMALL.canonical)))

    errors = [float((_render(scene) - truth).square().mean()) for scene in (initial, trained)]
    assert errors[1] < 0.5 * errors[0]


def test_pictures_of_half_the_size_are_used_at_both_sizes():
    rasterizer = _CountingRasterizer()
    context = replace(make_context(), rasterizer=rasterizer)
    _train(replace(_ENSEMBLE, half_resolution_until_iter=20), context)

    training_cameras = {(camera.rotation, camera.translation) for camera in context.views.cameras}
    widths = {
        camera.width
        for camera in rasterizer.trained_cameras
        if (camera.rotation, camera.translation) not in training_cameras
    }
    assert widths == {WIDTH, WIDTH // 2}


@pytest.mark.parametrize(
    ("half_until", "expected"), [(0, 0), (5, 15), (10, 30), (20, 40), (100, 60)]
)
def test_steps_at_half_resolution_include_all_scenes(half_until, expected):
    settings = replace(_ENSEMBLE, half_resolution_until_iter=half_until)

    assert settings.half_resolution_steps == expected


def test_scenes_are_counted_as_complete_when_the_next_one_has_started():
    counts = [_ENSEMBLE.count_ensemble(step) for step in (1, 10, 11, 20, 21, 30, 31, 60)]

    assert counts == [0, 0, 1, 1, 2, 2, 3, 3]
    assert CanonicalSettings().count_ensemble(15_000) == 0


@pytest.mark.parametrize(
    ("densify_until", "fine_tuning_from", "expected"), [(30, 0.8, 30), (35, 0.8, 32)]
)
def test_pseudo_views_end_with_densification_or_at_fine_tuning(
    densify_until, fine_tuning_from, expected
):
    settings = replace(_ENSEMBLE, densify_until_iter=densify_until, quantize_from=fine_tuning_from)

    assert settings.pseudo_view_steps == range(_START, expected)


@pytest.mark.parametrize(
    "changes", [{"densify_until_iter": 10}, {"pseudo_view_ratio": 0.0}, {"pseudo_views_from": 1.0}]
)
def test_without_pseudo_views_only_one_scene_is_trained(changes):
    settings = replace(_ENSEMBLE, **changes)
    trained, alone = _train(settings), _train(replace(settings, ensemble_size=1))

    assert settings.training_steps == settings.iterations
    assert settings.pseudo_view_count == 0
    assert all(map(torch.equal, trained.tensors(), alone.tensors()))
