from dataclasses import replace

import numpy as np
import pytest
import torch

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.canonical import start_from_points
from quarc_ref.encoder.training.empty_space import EmptySpace
from tests.encoder.toys import make_capture, make_context


@pytest.fixture(scope="module")
def context():
    return make_context()


@pytest.fixture(scope="module")
def points():
    return make_capture().points


@pytest.fixture
def surface(context, points):
    generator = torch.Generator().manual_seed(0)
    return start_from_points(points, CanonicalSettings(), generator, context.device)


def _put_before(camera, attributes, share):
    """Attributes whose first Gaussian is between a camera and the center of the others."""
    rotation = np.reshape(camera.rotation, (3, 3))
    eye = -rotation.T @ np.array(camera.translation)
    middle = attributes.means.mean(dim=0).numpy()
    means = attributes.means.clone()
    means[0] = torch.tensor(eye + share * (middle - eye), dtype=torch.float32)
    return replace(attributes, means=means)


def _measure(context, points, attributes, times=40):
    space = EmptySpace(context.views.cameras, points)
    generator = torch.Generator().manual_seed(2)
    return sum(space.measure_haze(attributes, context.rasterizer, generator) for _ in range(times))


def test_a_surface_at_the_points_is_not_haze(context, points, surface):
    assert _measure(context, points, surface) == 0


def test_gaussians_close_to_a_camera_are_haze_for_its_neighbors(context, points, surface):
    hazy = _put_before(context.camera(0), surface, 0.2)

    assert float(_measure(context, points, hazy)) > 0


def test_only_the_opacity_of_close_gaussians_has_a_gradient(context, points, surface):
    hazy = _put_before(context.camera(0), surface, 0.2)
    leaves = [tensor.requires_grad_() for tensor in hazy.tensors()]

    gradients = torch.autograd.grad(_measure(context, points, hazy), leaves, allow_unused=True)

    of_opacities = gradients[3]
    assert of_opacities is not None
    assert of_opacities[0] > 0
    assert not of_opacities[1:].any()
    assert all(gradient is None for place, gradient in enumerate(gradients) if place != 3)


def test_a_capture_with_a_single_camera_is_its_own_neighbor(context, points, surface):
    hazy = _put_before(context.camera(0), surface, 0.2)
    space = EmptySpace((context.camera(0),), points)

    haze = space.measure_haze(hazy, context.rasterizer, torch.Generator().manual_seed(2))

    assert float(haze) > 0


def test_cameras_that_see_no_point_have_the_depth_of_the_others(context, points, surface):
    camera = context.camera(0)
    turned = np.diag([-1.0, 1.0, -1.0]) @ np.reshape(camera.rotation, (3, 3))
    moved = np.diag([-1.0, 1.0, -1.0]) @ np.array(camera.translation)
    away = replace(camera, rotation=tuple(turned.ravel()), translation=tuple(moved))

    space = EmptySpace((camera, away), points)

    assert float(_measure(context, points, surface)) == 0
    assert space.scene_depths[1] == space.scene_depths[0]
