"""Renders pictures and depth ranges of a scene, and samples points on its surfaces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.capture import Alpha, Image, Points
from quarc_ref.synth.render_kernels import measure_depths, render_picture
from quarc_ref.synth.rig import RigCamera
from quarc_ref.synth.scene_arrays import SceneArrays

_POINT_NOISE = 0.002  # meters; standard deviation of the error of point positions
_ALPHA_SAMPLES = 4  # rays across the width and height of a pixel
_LENS_BLUR = (1 / 6, 4 / 6, 1 / 6)  # standard deviation of 0.58 pixels, similar to a good lens


@dataclass(frozen=True, slots=True, eq=False)
class TracedView:
    """A scene rendered for a camera.

    Attributes:
        picture: `[H, W, 3]` picture in sRGB, 8 bits.
        min_depth: Minimum depth, meters.
        max_depth: Maximum depth, meters.
    """

    picture: Image
    min_depth: float
    max_depth: float


def trace_view(scene_arrays: SceneArrays, camera: RigCamera) -> TracedView:
    """Render a scene for a camera."""
    light = np.empty((camera.height, camera.width, 3))
    depths = np.empty((camera.height, camera.width, 2))
    render_picture(scene_arrays, camera.as_row(), light, depths)
    recorded_light = _blur(_blur(light, axis=0), axis=1) @ camera.color_matrix.T
    picture = _encode_srgb(np.clip(recorded_light, 0, 1))
    return TracedView(picture, float(depths[..., 0].min()), float(depths[..., 1].max()))


def trace_alpha(
    scene_arrays: SceneArrays, background_arrays: SceneArrays, camera: RigCamera
) -> Alpha:
    """Return how much of each pixel `[H, W]` a subject covers, 0 to 255.

    Args:
        scene_arrays: Arrays of the scene.
        background_arrays: Arrays of the scene without the subject.
        camera: The camera.
    """
    size = (camera.height * _ALPHA_SAMPLES, camera.width * _ALPHA_SAMPLES)
    rows, columns = np.indices(size).reshape(2, -1)
    pixels = (np.stack((columns, rows), axis=1) + 0.5) / _ALPHA_SAMPLES
    depths, background_depths = np.empty(len(pixels)), np.empty(len(pixels))
    measure_depths(scene_arrays, camera.as_row(), pixels, depths)
    measure_depths(background_arrays, camera.as_row(), pixels, background_depths)
    is_covered = (depths < background_depths).reshape(
        camera.height, _ALPHA_SAMPLES, camera.width, _ALPHA_SAMPLES
    )
    return np.asarray(np.rint(255 * is_covered.mean(axis=(1, 3))), dtype=np.uint8)


def trace_points(
    scene_arrays: SceneArrays,
    camera: RigCamera,
    picture: Image,
    point_count: int,
    generator: np.random.Generator,
) -> Points:
    """Sample points on the surfaces that a camera sees, similar to structure-from-motion points.

    Args:
        scene_arrays: Arrays of the scene.
        camera: The camera that sees the points.
        picture: The camera's picture, from which the colors of the points are taken.
        point_count: Number of points; each point is sampled at a random pixel.
        generator: Random number generator for the pixels and for the noise of the positions.
    """
    rows = generator.integers(camera.height, size=point_count)
    columns = generator.integers(camera.width, size=point_count)
    pixels = np.stack((columns, rows), axis=1).astype(np.float64) + 0.5
    depths = np.empty(point_count)
    measure_depths(scene_arrays, camera.as_row(), pixels, depths)
    positions = camera.to_world(pixels, depths) + _POINT_NOISE * generator.standard_normal(
        (point_count, 3)
    )
    return Points(positions.astype(np.float32), picture[rows, columns])


def _blur(light: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Blur a picture along an axis to imitate a real lens."""
    left_weight, center_weight, right_weight = _LENS_BLUR
    padding = [(int(dimension == axis), int(dimension == axis)) for dimension in range(light.ndim)]
    padded = np.pad(light, padding, mode="edge")
    size = light.shape[axis]
    shifted_pictures = [
        np.take(padded, range(start, start + size), axis=axis) for start in range(3)
    ]
    return (
        left_weight * shifted_pictures[0]
        + center_weight * shifted_pictures[1]
        + right_weight * shifted_pictures[2]
    )


def _encode_srgb(light: NDArray[np.float64]) -> Image:
    """Encode linear light as sRGB."""
    power_law = 1.055 * np.power(light, 1 / 2.4) - 0.055
    encoded = np.where(light <= 0.0031308, 12.92 * light, power_law)
    return np.round(255 * encoded).astype(np.uint8)
