"""Pseudo-views: the median of several scenes, from cameras between the training cameras.

The pictures do not determine what hardly any training camera sees, and training fills such
places by chance, most often with haze near a camera, which other views show. Scenes that were
trained with other random numbers have haze in other places, so the median of their pictures
shows little of it. The medians therefore serve as additional training views. CoR-GS
(ECCV 2024) uses the difference of two scenes similarly, for captures with few views.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp
from torch import Tensor

from quarc_ref.datasets.calibration import downscale_camera
from quarc_ref.datasets.camera_geometry import camera_center, rotation_matrix
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.rasterizer import Rasterizer

_NEIGHBOR_COUNT = 4
_MIN_POSITION, _MAX_POSITION = 0.25, 0.75  # between a camera (0) and its neighbor (1)


@dataclass(frozen=True, slots=True, eq=False)
class PseudoView:
    """A camera between two training cameras, and what the ensemble shows there.

    Attributes:
        camera: The camera, at the full size of pictures.
        downscale: Integer factor by which width and height of the picture are reduced.
        picture: `[H, W, 3]` median of the ensemble's renderings, unclamped.
    """

    camera: Camera
    downscale: int
    picture: Tensor


class PseudoViews:
    """Pseudo-views of an ensemble of scenes.

    Args:
        scenes: The scenes.
        cameras: Training cameras, at the full size of pictures.
        downscale: Integer factor by which the width and height of pseudo-views are reduced.
        rasterizer: Renderer on the device of the scenes.
    """

    def __init__(
        self,
        scenes: Sequence[Attributes],
        cameras: Sequence[Camera],
        downscale: int,
        rasterizer: Rasterizer,
    ) -> None:
        self._downscale = downscale
        self._scenes = [scene.activated() for scene in scenes]
        self._cameras = cameras
        self._neighbors = _find_neighbors(np.array([camera_center(camera) for camera in cameras]))
        self._rasterizer = rasterizer

    def draw(self, generator: torch.Generator) -> PseudoView:
        """Return a random pseudo-view."""
        camera = self._draw_camera(generator)
        rendered_camera = downscale_camera(camera, self._downscale)
        background = self._scenes[0].means.new_zeros(3)
        with torch.no_grad():
            images = [
                self._rasterizer.render(scene, rendered_camera, background).image
                for scene in self._scenes
            ]
            return PseudoView(camera, self._downscale, _compute_median(torch.stack(images)))

    def _draw_camera(self, generator: torch.Generator) -> Camera:
        first = int(torch.randint(len(self._cameras), (1,), generator=generator))
        neighbors = self._neighbors[first]
        rank = int(torch.randint(neighbors.shape[0], (1,), generator=generator))
        share = float(torch.rand((), generator=generator))
        position = _MIN_POSITION + (_MAX_POSITION - _MIN_POSITION) * share
        return interpolate_cameras(self._cameras[first], self._cameras[neighbors[rank]], position)


def _compute_median(images: Tensor) -> Tensor:
    """Return the median over the first axis; of an even number, the mean of the middle two."""
    count = images.shape[0]
    return images.sort(dim=0).values[(count - 1) // 2 : count // 2 + 1].mean(dim=0)


def _find_neighbors(centers: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the indices `[V, K]` of the nearest other cameras, or of a camera itself if alone."""
    distances = np.linalg.norm(centers[:, None] - centers, axis=2)
    np.fill_diagonal(distances, np.inf)
    neighbors: NDArray[np.int64] = np.argsort(distances, axis=1, kind="stable")
    return neighbors[:, : max(1, min(_NEIGHBOR_COUNT, len(centers) - 1))]


def interpolate_cameras(first: Camera, second: Camera, position: float) -> Camera:
    """Return a camera between two others, with the intrinsics and the near plane of the first.

    Args:
        first: Camera at position 0.
        second: Camera at position 1.
        position: Position between the two, 0 to 1.
    """
    rotations = Rotation.from_matrix(np.stack([rotation_matrix(first), rotation_matrix(second)]))
    rotation = Slerp([0, 1], rotations)(position).as_matrix()
    center = (1 - position) * camera_center(first) + position * camera_center(second)
    return replace(
        first,
        rotation=tuple(rotation.ravel().tolist()),
        translation=tuple((-rotation @ center).tolist()),
    )
