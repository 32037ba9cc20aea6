"""Keeps the space in front of cameras empty where the pictures say nothing of it.

Close to a camera, few others see the same space. Haze there fits the errors of one picture,
such as an exposure that is off, and covers the scene for a viewer between the cameras. So
training also renders from virtual cameras, each between a training camera and one of its
neighbors, and the loss has a term for the opacity of what is close to them. Real objects that are
close are seen by several cameras, whose pictures outweigh that term.
"""

from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp
from torch import Tensor

from quarc_ref.datasets.calibration import shrink
from quarc_ref.datasets.camera_geometry import camera_center, project_points, rotation_matrix
from quarc_ref.datasets.capture import Points
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.rasterizer import Rasterizer

_NEIGHBORS = 5
_SHRINK = 4  # a virtual picture is smaller than the camera's by this, on each side
_CLOSE = 0.35  # of the depth of the scene


class EmptySpace:
    """Renders what is close to virtual cameras.

    Args:
        cameras: Training cameras.
        points: Initial points, from which the depth of the scene is measured.

    Attributes:
        scene_depths: `[C]` median depth of the points that each camera sees, world units; a
            camera that sees none has the median of the others.
    """

    def __init__(self, cameras: tuple[Camera, ...], points: Points) -> None:
        self._cameras = cameras
        self._rotations = Rotation.from_matrix([rotation_matrix(camera) for camera in cameras])
        self._centers = np.array([camera_center(camera) for camera in cameras])
        self.scene_depths = _measure_scene_depths(cameras, points)
        apart = np.linalg.norm(self._centers[:, None] - self._centers, axis=2)
        np.fill_diagonal(apart, -1.0)  # each camera is first in its own row
        self._neighbors = np.argsort(apart, axis=1, kind="stable")[:, 1 : 1 + _NEIGHBORS]

    def measure_haze(
        self, attributes: Attributes, rasterizer: Rasterizer, generator: torch.Generator
    ) -> Tensor | float:
        """Measure the mean opacity of what is close to a random virtual camera.

        Args:
            attributes: Gaussians in training; gradients go to their opacities alone.
            rasterizer: Renders them.
            generator: Chooses the camera.

        Returns:
            0 to 1.
        """
        camera, depth = self._place_camera(generator)
        forward, offset = torch.tensor(camera.rotation[6:]), camera.translation[2]
        means = attributes.means.detach()
        depths = means @ forward.to(means) + offset
        rows = (depths > camera.near) & (depths < _CLOSE * depth)
        if not bool(rows.any()):
            return 0.0
        fixed = attributes.detached().rows(rows)
        close = replace(fixed, opacities=attributes.opacities[rows])
        background = torch.zeros(3, device=means.device)
        return rasterizer.render(close.activated(), camera, background).alpha.mean()

    def _place_camera(self, generator: torch.Generator) -> tuple[Camera, float]:
        """A camera between a random one and one of its neighbors, and the depth of the scene."""
        first = _draw(len(self._cameras), generator)
        neighbors = self._neighbors[first]
        second = int(neighbors[_draw(len(neighbors), generator)]) if len(neighbors) else first
        share = float(torch.rand((), generator=generator))
        way = Slerp([0.0, 1.0], self._rotations[[first, second]])
        rotation = way(share)
        center = (1 - share) * self._centers[first] + share * self._centers[second]
        camera = replace(
            shrink(self._cameras[first], _SHRINK),
            rotation=tuple(rotation.as_matrix().ravel().tolist()),
            translation=tuple((-rotation.apply(center)).tolist()),
        )
        depth = (1 - share) * self.scene_depths[first] + share * self.scene_depths[second]
        return camera, float(depth)


def _measure_scene_depths(cameras: tuple[Camera, ...], points: Points) -> NDArray[np.float64]:
    depths = [_measure_depth(camera, points) for camera in cameras]
    known = [depth for depth in depths if depth is not None]
    usual = float(np.median(known)) if known else 0.0
    return np.array([usual if depth is None else depth for depth in depths])


def _measure_depth(camera: Camera, points: Points) -> float | None:
    """Median depth of the points that a camera sees, None if it sees none."""
    projected = project_points(camera, points.positions)
    seen = projected.within & (projected.depths > camera.near)
    return float(np.median(projected.depths[seen])) if seen.any() else None


def _draw(count: int, generator: torch.Generator) -> int:
    return int(torch.randint(0, count, (), generator=generator))
