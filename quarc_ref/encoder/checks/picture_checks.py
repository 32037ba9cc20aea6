"""Compares the cameras' pictures of one moment: exposure, colors, blur, duplicates.

Cameras are compared at the initial points that both see, so that a camera with a darker
part of the scene in view does not appear underexposed.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from quarc_ref.datasets.camera_geometry import PointProjection
from quarc_ref.datasets.capture import Image
from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.encoder.checks.visibility import drop_hidden
from quarc_ref.format.cameras import Camera

_GAMMA = 2.2
_BLACK, _WHITE = 8, 247  # levels outside of which a ratio is not informative
_ENOUGH_VIEWS = 3
_MIN_POINTS = 50
_MAX_STOPS = 0.8  # the encoder estimates and corrects smaller gains
_MAX_TINT = 0.45
_MAX_BLUR = 0.1  # above that of the median camera
_TWIN_LEVELS = 0.5
_MAX_SHARP = 1024  # pixels: size of the central square in which blur is measured
_SMALL = 32

Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class _Looks:
    """Measurements of a camera's picture.

    Attributes:
        light: `[P, 3]` base-2 logarithms of linear light at the points; NaN where the
            camera does not see a point, or sees it black or white.
        blur: Blur from 0 (noise) to 1 (no detail).
        small: `[rows, columns]` downscaled gray picture.
    """

    light: Numbers
    blur: float
    small: Numbers


def find_odd_pictures(
    cameras: Sequence[Camera], projections: Sequence[PointProjection], pictures: Iterable[Image]
) -> Iterator[Finding]:
    """Yield findings about cameras whose pictures differ from the others.

    Args:
        cameras: Cameras, at least two.
        projections: Projection of the initial points into each camera.
        pictures: `[H, W, 3]` sRGB of one moment, one per camera.
    """
    names = [camera.name for camera in cameras]
    looks = [_measure_looks(*each) for each in zip(cameras, projections, pictures, strict=True)]
    stops = _compare_light(np.stack([look.light for look in looks]))
    yield from _find_exposures(names, stops)
    yield from _find_colors(names, stops)
    yield from _find_blurred(names, np.array([look.blur for look in looks]))
    yield from _find_equal_pictures(names, [look.small for look in looks])


def _measure_looks(camera: Camera, projection: PointProjection, picture: Image) -> _Looks:
    light = np.full((len(projection.depths), 3), np.nan)
    shown = drop_hidden(camera, projection)
    rows, columns = (
        np.floor(a[shown]).astype(np.int64) for a in (projection.rows, projection.columns)
    )
    levels = picture[rows, columns].astype(np.float64)
    usable = ((levels > _BLACK) & (levels < _WHITE)).all(axis=1)
    light[shown[usable]] = _GAMMA * np.log2(levels[usable] / 255)
    gray = picture.astype(np.float32).mean(axis=2)
    return _Looks(light, _measure_blur(gray), _average(gray))


def _compare_light(light: Numbers) -> Numbers:
    """Return `[camera, 4]` differences from most cameras in stops: exposure, then tints.

    The lower quartile over the points is used, because undetected occlusions are not
    differences between cameras.

    Args:
        light: `[camera, P, 3]` light of each camera, from `_Looks`.
    """
    seen = np.isfinite(light[..., 0])
    shared = seen.sum(axis=0) >= _ENOUGH_VIEWS
    light, seen = light[:, shared], seen[:, shared]
    stops = np.zeros((len(light), 4))
    if not light.size:
        return stops
    differences = light - np.nanmedian(light, axis=0)
    for camera, own in enumerate(seen):
        if own.sum() >= _MIN_POINTS:
            exposures = np.median(differences[camera, own], axis=1, keepdims=True)
            tints = differences[camera, own] - exposures
            low, high = np.quantile(np.hstack([exposures, tints]), (0.25, 0.75), axis=0)
            stops[camera] = np.where(low > 0, low, np.where(high < 0, high, 0.0))
    return stops


def _find_exposures(names: Sequence[str], stops: Numbers) -> Iterator[Finding]:
    exposures = stops[:, 0]
    odd = np.flatnonzero(np.abs(exposures) > _MAX_STOPS).tolist()
    if odd:
        listed = [f"{names[i]} by {exposures[i]:+.1f} stops" for i in odd]
        message = (
            f"exposures differ from those of most cameras: {format_names(listed)}. Lock "
            "exposure, ISO and aperture, or correct the videos; the encoder corrects only "
            "smaller differences"
        )
        yield Finding("exposure-differs", message, tuple(names[i] for i in odd))


def _find_colors(names: Sequence[str], stops: Numbers) -> Iterator[Finding]:
    tints = stops[:, 1:]
    odd = np.flatnonzero(np.abs(tints).max(axis=1) > _MAX_TINT).tolist()
    if odd:
        listed = [
            f"{names[i]} (red {tints[i, 0]:+.1f}, green {tints[i, 1]:+.1f}, blue "
            f"{tints[i, 2]:+.1f} stops)"
            for i in odd
        ]
        message = (
            f"colors differ from those of most cameras: {format_names(listed)}. Lock the white "
            "balance, or correct the videos"
        )
        yield Finding("colors-differ", message, tuple(names[i] for i in odd))


def _find_blurred(names: Sequence[str], blurs: Numbers) -> Iterator[Finding]:
    odd = tuple(names[i] for i in np.flatnonzero(blurs > np.median(blurs) + _MAX_BLUR).tolist())
    if odd:
        message = (
            f"the pictures of {format_names(odd)} are more blurred than those of the other "
            "cameras: check focus and shutter, or remove these cameras"
        )
        yield Finding("blurred", message, odd)


def _find_equal_pictures(names: Sequence[str], pictures: Sequence[Numbers]) -> Iterator[Finding]:
    for first in range(len(names)):
        for second in range(first + 1, len(names)):
            pair = pictures[first], pictures[second]
            if pair[0].shape == pair[1].shape and np.abs(pair[0] - pair[1]).max() < _TWIN_LEVELS:
                both = names[first], names[second]
                message = (
                    f"{both[0]} and {both[1]} show the same picture: one file is a copy of "
                    "the other; use the right one"
                )
                yield Finding("same-pictures", message, both)


def _measure_blur(gray: NDArray[np.float32]) -> float:
    """Measure the blur of a picture, from 0 to 1.

    The measure is that of Crete et al., "The Blur Effect" (2007): the share of
    differences between neighbors that remains after blurring, for the axis where it is
    larger.
    """
    size = 2 * max(2, gray.shape[1] // 100) + 1
    top, left = (max(0, (side - _MAX_SHARP) // 2) for side in gray.shape)
    gray = gray[top : top + _MAX_SHARP, left : left + _MAX_SHARP]
    shares = []
    for axis in (0, 1):
        blurred = uniform_filter1d(gray, size, axis=axis)
        sharp, soft = (np.abs(np.diff(each, axis=axis)) for each in (gray, blurred))
        lost = np.maximum(0, sharp - soft).sum()
        whole = float(sharp.sum())
        shares.append((whole - float(lost)) / whole if whole else 1.0)
    return max(shares)


def _average(gray: NDArray[np.float32]) -> Numbers:
    """Downscale a picture by averaging squares, to about `_SMALL` columns."""
    side = max(1, gray.shape[1] // _SMALL)
    rows, columns = gray.shape[0] // side, gray.shape[1] // side
    cut = gray[: rows * side, : columns * side].reshape(rows, side, columns, side)
    return np.asarray(cut.mean(axis=(1, 3)), dtype=np.float64)
