"""The cameras of a synthetic capture, and their rows of `poses_bounds.npy`.

The cameras are on an arc around the stage, at alternating heights, and look at the center of
the stage. The first camera, which is held out, is halfway between two other cameras.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from quarc_ref.synth.options import SynthOptions, draw_uniform, make_generator

Float64 = NDArray[np.float64]

_ARC_ANGLE = math.radians(80)
_ARC_RADIUS = 3.45
_CAMERA_HEIGHTS = (1.15, 1.75)
_TARGET = np.array([0.0, 0.72, -0.1])
_HALF_FIELD_OF_VIEW = math.radians(25.5)
_HALL_HALF_FIELD_OF_VIEW = math.radians(36)
_JITTER_RANGE = 0.06  # meters; range of the random offsets of positions and targets
_NEAR_FACTOR, _FAR_FACTOR = 0.95, 1.02
_EXPOSURE_PERIOD = 1.0  # seconds


@dataclass(frozen=True, slots=True, eq=False)
class RigCamera:
    """A pinhole camera with its principal point at the center of the picture.

    Attributes:
        center: `[3]` position, world units.
        axes: `[3, 3]` rows: the directions right, down and forward in world space.
        focal_length: Focal length, pixels.
        width: Picture width, pixels.
        height: Picture height, pixels.
        color_matrix: `[3, 3]` matrix that maps the linear RGB of the scene to recorded linear RGB.
        exposure_amplitude: Amplitude of the logarithm of the exposure, which changes over time.
        exposure_phase: Phase of the exposure at time 0, radians.
    """

    center: Float64
    axes: Float64
    focal_length: float
    width: int
    height: int
    color_matrix: Float64
    exposure_amplitude: float = 0.0
    exposure_phase: float = 0.0

    def at_time(self, time: float) -> "RigCamera":
        """Return the camera with its exposure at a time in seconds."""
        angle = 2 * math.pi * time / _EXPOSURE_PERIOD + self.exposure_phase
        gain = math.exp(self.exposure_amplitude * math.sin(angle))
        return replace(self, color_matrix=gain * self.color_matrix)

    def as_row(self) -> Float64:
        """Return the camera as `[15]` numbers for `render_kernels.render_picture`."""
        principal_point = (self.width / 2, self.height / 2)
        return np.array([*self.center, *self.axes.ravel(), self.focal_length, *principal_point])

    def to_world(self, pixels: Float64, depths: Float64) -> Float64:
        """Return the `[N, 3]` world points at pixel positions `[N, 2]` and depths `[N]`."""
        directions = (pixels - (self.width / 2, self.height / 2)) / self.focal_length
        rays = np.column_stack((directions, np.ones(len(depths))))
        return self.center + depths[:, None] * (rays @ self.axes)

    def as_poses_bounds_row(self, min_depth: float, max_depth: float) -> Float64:
        """Return the camera's row `[17]` of `poses_bounds.npy`.

        Args:
            min_depth: Minimum depth over all frames of the camera.
            max_depth: Maximum depth over all frames of the camera.
        """
        right, down, forward = self.axes
        size = np.array([self.height, self.width, self.focal_length])
        pose = np.stack((down, right, -forward, self.center, size), axis=1)
        return np.array([*pose.ravel(), _NEAR_FACTOR * min_depth, _FAR_FACTOR * max_depth])


def place_cameras(options: SynthOptions) -> tuple[RigCamera, ...]:
    """Return the held-out camera, then the training cameras from left to right."""
    training_angles = (np.arange(options.cameras) / (options.cameras - 1) - 0.5) * _ARC_ANGLE
    left_neighbor = (options.cameras - 1) // 2
    held_out_angle = (training_angles[left_neighbor] + training_angles[left_neighbor + 1]) / 2
    heights = [_CAMERA_HEIGHTS[i % 2] for i in range(options.cameras)]
    angles = (held_out_angle, *training_angles)
    jitter = draw_uniform(options.seed, "cameras", 6 * len(angles)).reshape(-1, 6) - 0.5
    color_matrices = _make_color_matrices(len(angles), options)
    phases = 2 * math.pi * draw_uniform(options.seed, "exposures", len(angles))
    camera_parameters = zip(
        angles, (sum(_CAMERA_HEIGHTS) / 2, *heights), jitter, color_matrices, phases, strict=True
    )
    return tuple(
        replace(
            _make_camera(angle, height, offsets * _JITTER_RANGE, options),
            color_matrix=color_matrix,
            exposure_amplitude=options.variant_properties.exposure_amplitude,
            exposure_phase=float(phase),
        )
        for angle, height, offsets, color_matrix, phase in camera_parameters
    )


def _make_color_matrices(camera_count: int, options: SynthOptions) -> Float64:
    """Return `[camera_count, 3, 3]` color matrices, all identity if `camera_gain_spread` is 0."""
    spread = options.variant_properties.camera_gain_spread
    random_numbers = make_generator(options.seed, "films").standard_normal((camera_count, 4, 3))
    gains = np.exp(spread * (0.95 * random_numbers[:, 0, :1] + 0.3 * random_numbers[:, 1]))
    return np.eye(3) * gains[:, None] + spread / 10 * random_numbers[:, 1:]


def _make_camera(angle: float, height: float, offsets: Float64, options: SynthOptions) -> RigCamera:
    center = (
        np.array([_ARC_RADIUS * math.sin(angle), height, _ARC_RADIUS * math.cos(angle)])
        + offsets[:3]
    )
    forward = _TARGET + offsets[3:] - center
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, (0.0, 1.0, 0.0))
    right = right / np.linalg.norm(right)
    axes = np.stack((right, np.cross(forward, right), forward))
    half_field_of_view = (
        _HALL_HALF_FIELD_OF_VIEW if options.variant_properties.is_hall else _HALF_FIELD_OF_VIEW
    )
    focal_length = options.width / (2 * math.tan(half_field_of_view))
    return RigCamera(center, axes, focal_length, options.width, options.height, np.eye(3))
