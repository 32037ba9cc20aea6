"""The cameras of a synthetic capture, and their form in `poses_bounds.npy`.

Cameras are on an arc around the stage, alternately lower and higher, and look at its
center. The first, held-out camera is on the arc halfway between two neighbors.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.synth.options import SynthOptions, draw, make_generator

Float64 = NDArray[np.float64]

_ARC = math.radians(80)
_RADIUS = 3.45
_HEIGHTS = (1.15, 1.75)
_TARGET = np.array([0.0, 0.72, -0.1])
_HALF_VIEW = math.radians(25.5)
_STAGE_HALF_VIEW = math.radians(36)
_JITTER = 0.06  # meters: range of positions
_NEAR_MARGIN, _FAR_MARGIN = 0.95, 1.02


@dataclass(frozen=True, slots=True, eq=False)
class RigCamera:
    """A pinhole camera with its principal point at the center of the picture.

    Attributes:
        center: `[3]` position, world units.
        axes: `[3, 3]` world directions right, down, forward, by row.
        focal: Focal length, pixels.
        width: Picture width, pixels.
        height: Picture height, pixels.
        film: `[3, 3]` matrix from incoming to recorded linear RGB.
    """

    center: Float64
    axes: Float64
    focal: float
    width: int
    height: int
    film: Float64

    def as_row(self) -> Float64:
        """Return `[15]` center, right, down, forward, focal length, principal point."""
        middle = (self.width / 2, self.height / 2)
        return np.array([*self.center, *self.axes.ravel(), self.focal, *middle])

    def to_world(self, pixels: Float64, depths: Float64) -> Float64:
        """Return the `[N, 3]` world points at pixels `[N, 2]` and their depths."""
        slopes = (pixels - (self.width / 2, self.height / 2)) / self.focal
        rays = np.column_stack((slopes, np.ones(len(depths))))
        return self.center + depths[:, None] * (rays @ self.axes)

    def as_pose(self, least: float, most: float) -> Float64:
        """Return the camera's row `[17]` of `poses_bounds.npy`.

        Args:
            least: Minimum depth in all frames of the camera.
            most: Maximum depth.
        """
        right, down, forward = self.axes
        size = np.array([self.height, self.width, self.focal])
        pose = np.stack((down, right, -forward, self.center, size), axis=1)
        return np.array([*pose.ravel(), _NEAR_MARGIN * least, _FAR_MARGIN * most])


def place_cameras(options: SynthOptions) -> tuple[RigCamera, ...]:
    """Return the held-out camera, then the training cameras from left to right."""
    steps = (np.arange(options.cameras) / (options.cameras - 1) - 0.5) * _ARC
    between = (options.cameras - 1) // 2
    held_out = (steps[between] + steps[between + 1]) / 2
    heights = [_HEIGHTS[i % 2] for i in range(options.cameras)]
    angles = (held_out, *steps)
    jitter = draw(options.seed, "cameras", 6 * len(angles)).reshape(-1, 6) - 0.5
    films = _make_films(len(angles), options)
    places = zip(angles, (sum(_HEIGHTS) / 2, *heights), jitter, films, strict=True)
    return tuple(
        _camera(angle, height, shift * _JITTER, film, options)
        for angle, height, shift, film in places
    )


def _make_films(count: int, options: SynthOptions) -> Float64:
    """Return the `[count, 3, 3]` films of the cameras, which are equal without a spread."""
    spread = options.scene.camera_spread
    normal = make_generator(options.seed, "films").standard_normal((count, 4, 3))
    gains = np.exp(spread * (0.95 * normal[:, 0, :1] + 0.3 * normal[:, 1]))
    return np.eye(3) * gains[:, None] + spread / 10 * normal[:, 1:]


def _camera(
    angle: float, height: float, shift: Float64, film: Float64, options: SynthOptions
) -> RigCamera:
    center = np.array([_RADIUS * math.sin(angle), height, _RADIUS * math.cos(angle)]) + shift[:3]
    forward = _TARGET + shift[3:] - center
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, (0.0, 1.0, 0.0))
    right = right / np.linalg.norm(right)
    axes = np.stack((right, np.cross(forward, right), forward))
    half_view = _STAGE_HALF_VIEW if options.scene.is_stage else _HALF_VIEW
    focal = options.width / (2 * math.tan(half_view))
    return RigCamera(center, axes, focal, options.width, options.height, film)
