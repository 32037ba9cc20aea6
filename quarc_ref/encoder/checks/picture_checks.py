"""Compares the pictures of all cameras at frame 0: exposure, colors, blur, duplicates.

Exposure and colors are compared at initial points that several cameras see, so that a
camera that views a darker part of the scene does not appear underexposed.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from quarc_ref.datasets.camera_geometry import PointProjection
from quarc_ref.datasets.capture import Image
from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.encoder.checks.equal_pictures import (
    Thumbnail,
    find_equal_pictures,
    make_thumbnail,
)
from quarc_ref.encoder.checks.visibility import find_visible_points
from quarc_ref.format.cameras import Camera

_GAMMA = 2.2
_BLACK, _WHITE = 8, 247  # darker and brighter levels are not compared
_MIN_VIEWS = 3
_MIN_POINTS = 50
_MAX_EXPOSURE_STOPS = 0.8  # the encoder estimates and corrects smaller gains
_MAX_TINT_STOPS = 0.45
_MAX_BLUR_EXCESS = 0.1  # above the median blur of all cameras
_BLUR_WINDOW_PIXELS = 1024  # size of the central square in which blur is measured

Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class _PictureMeasurements:
    """Measurements of a camera's picture.

    Attributes:
        log_light: `[P, 3]` base-2 logarithms of linear light at the points; NaN for points that
            the camera does not see, or that are almost black or white.
        blur: Blur from 0 (noise) to 1 (no detail).
        thumbnail: `[rows, columns]` downscaled gray picture.
    """

    log_light: Numbers
    blur: float
    thumbnail: Thumbnail


def find_odd_pictures(
    cameras: Sequence[Camera], projections: Sequence[PointProjection], pictures: Iterable[Image]
) -> Iterator[Finding]:
    """Yield findings about cameras whose pictures differ from those of other cameras.

    Args:
        cameras: Cameras, at least two.
        projections: Projection of the initial points into each camera.
        pictures: `[H, W, 3]` sRGB picture of each camera at the same frame.
    """
    names = [camera.name for camera in cameras]
    measurements = [
        _measure_picture(*camera_data)
        for camera_data in zip(cameras, projections, pictures, strict=True)
    ]
    stops = _compare_light(np.stack([measurement.log_light for measurement in measurements]))
    yield from _find_odd_exposures(names, stops)
    yield from _find_odd_tints(names, stops)
    yield from _find_blurred(names, np.array([measurement.blur for measurement in measurements]))
    yield from find_equal_pictures(names, [measurement.thumbnail for measurement in measurements])


def _measure_picture(
    camera: Camera, projection: PointProjection, picture: Image
) -> _PictureMeasurements:
    log_light = np.full((len(projection.depths), 3), np.nan)
    visible_indices = find_visible_points(camera, projection)
    rows, columns = (
        np.floor(coordinates[visible_indices]).astype(np.int64)
        for coordinates in (projection.rows, projection.columns)
    )
    levels = picture[rows, columns].astype(np.float64)
    is_usable = ((levels > _BLACK) & (levels < _WHITE)).all(axis=1)
    log_light[visible_indices[is_usable]] = _GAMMA * np.log2(levels[is_usable] / 255)
    gray = picture.astype(np.float32).mean(axis=2)
    return _PictureMeasurements(log_light, _measure_blur(gray), make_thumbnail(gray))


def _compare_light(log_light: Numbers) -> Numbers:
    """Return `[camera, 4]` exposure and three tints relative to the median camera, in stops.

    Each value is the lower or upper quartile over the points, whichever is nearer to 0 (or 0 if
    their signs differ), because undetected occlusions at some points exaggerate differences.

    Args:
        log_light: `[camera, P, 3]` `_PictureMeasurements.log_light` of each camera.
    """
    is_measured = np.isfinite(log_light[..., 0])
    is_shared = is_measured.sum(axis=0) >= _MIN_VIEWS
    log_light, is_measured = log_light[:, is_shared], is_measured[:, is_shared]
    stops = np.zeros((len(log_light), 4))
    if not log_light.size:
        return stops
    differences = log_light - np.nanmedian(log_light, axis=0)
    for camera, is_camera_measured in enumerate(is_measured):
        if is_camera_measured.sum() >= _MIN_POINTS:
            exposures = np.median(differences[camera, is_camera_measured], axis=1, keepdims=True)
            tints = differences[camera, is_camera_measured] - exposures
            lower_quartiles, upper_quartiles = np.quantile(
                np.hstack([exposures, tints]), (0.25, 0.75), axis=0
            )
            stops[camera] = np.where(
                lower_quartiles > 0,
                lower_quartiles,
                np.where(upper_quartiles < 0, upper_quartiles, 0.0),
            )
    return stops


def _find_odd_exposures(names: Sequence[str], stops: Numbers) -> Iterator[Finding]:
    exposures = stops[:, 0]
    camera_indices = np.flatnonzero(np.abs(exposures) > _MAX_EXPOSURE_STOPS).tolist()
    if camera_indices:
        descriptions = [f"{names[i]} by {exposures[i]:+.1f} stops" for i in camera_indices]
        message = (
            "the exposures of these cameras differ from those of most cameras: "
            f"{format_names(descriptions)}. Lock exposure, ISO and aperture, or correct the "
            "videos; the encoder corrects only smaller differences"
        )
        yield Finding("exposure-differs", message, tuple(names[i] for i in camera_indices))


def _find_odd_tints(names: Sequence[str], stops: Numbers) -> Iterator[Finding]:
    tints = stops[:, 1:]
    camera_indices = np.flatnonzero(np.abs(tints).max(axis=1) > _MAX_TINT_STOPS).tolist()
    if camera_indices:
        descriptions = [
            f"{names[i]} (red {tints[i, 0]:+.1f}, green {tints[i, 1]:+.1f}, blue "
            f"{tints[i, 2]:+.1f} stops)"
            for i in camera_indices
        ]
        message = (
            "the colors of these cameras differ from those of most cameras: "
            f"{format_names(descriptions)}. Lock the white balance, or correct the videos"
        )
        yield Finding("colors-differ", message, tuple(names[i] for i in camera_indices))


def _find_blurred(names: Sequence[str], blurs: Numbers) -> Iterator[Finding]:
    blurred_cameras = tuple(
        names[i] for i in np.flatnonzero(blurs > np.median(blurs) + _MAX_BLUR_EXCESS).tolist()
    )
    if blurred_cameras:
        message = (
            f"the pictures of {format_names(blurred_cameras)} are more blurred than those of "
            "the other cameras: check focus and shutter, or remove these cameras"
        )
        yield Finding("blurred", message, blurred_cameras)


def _measure_blur(gray: NDArray[np.float32]) -> float:
    """Measure the blur of a picture, from 0 to 1.

    The method is from Crete et al., "The Blur Effect" (2007): the picture is blurred by a filter
    along each axis, and the fraction of the differences between neighboring pixels that remains is
    measured. The result is the larger of the two fractions.
    """
    filter_size = 2 * max(2, gray.shape[1] // 100) + 1
    top, left = (max(0, (length - _BLUR_WINDOW_PIXELS) // 2) for length in gray.shape)
    gray = gray[top : top + _BLUR_WINDOW_PIXELS, left : left + _BLUR_WINDOW_PIXELS]
    remaining_fractions = []
    for axis in (0, 1):
        blurred = uniform_filter1d(gray, filter_size, axis=axis)
        differences, blurred_differences = (
            np.abs(np.diff(image, axis=axis)) for image in (gray, blurred)
        )
        lost_difference = np.maximum(0, differences - blurred_differences).sum()
        total_difference = float(differences.sum())
        remaining_fractions.append(
            (total_difference - float(lost_difference)) / total_difference
            if total_difference
            else 1.0
        )
    return max(remaining_fractions)
