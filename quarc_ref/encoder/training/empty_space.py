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
        matrices = np.array([camera.rotation for camera in cameras]).reshape(-1, 3, 3)
        self._rotations = Rotation.from_matrix(matrices)
        translations = np.array([camera.translation for camera in cameras])
        self._centers = -self._rotations.inv().apply(translations)
        self.scene_depths = _measure_scene_depths(cameras, points)
        apart = np.linalg.norm(self._centers[:, None] - self._centers, axis=2)
        # Itself first: distance 0.
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
        real = self._cameras[first]
        camera = replace(
            real,
            width=max(real.width // _SHRINK, 1),
            height=max(real.height // _SHRINK, 1),
            fx=real.fx / _SHRINK,
            fy=real.fy / _SHRINK,
            cx=real.cx / _SHRINK,
            cy=real.cy / _SHRINK,
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
    rotation = np.reshape(camera.rotation, (3, 3))
    x, y, z = (points.positions @ rotation.T + camera.translation).T
    across, down = camera.fx * x + camera.cx * z, camera.fy * y + camera.cy * z
    seen = (z > camera.near) & (across >= 0) & (across < camera.width * z)
    seen &= (down >= 0) & (down < camera.height * z)
    return float(np.median(z[seen])) if seen.any() else None


def _draw(count: int, generator: torch.Generator) -> int:
    return int(torch.randint(0, count, (), generator=generator))
