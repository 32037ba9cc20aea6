"""Undistorts and downscales pictures.

The pinhole picture shows the largest axis-aligned rectangle inside the distorted picture, so every
pinhole pixel has a color. In OpenCV, pixel centers are at whole numbers, so half a pixel is
subtracted from principal points before OpenCV is called, and added afterwards.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.calibration import Float64Array, Lens, downscale_camera
from quarc_ref.datasets.capture import Image
from quarc_ref.datasets.errors import UnsupportedCameraError

_STOP_CRITERIA = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-9)
_MAX_HALF_FIELD_TANGENT = 6.0  # Tangent of a pinhole's largest half field of view, 80.5 degrees.
_MASK_THRESHOLD = 128  # Of 255; pixels are used if the mask covers at least half of them.
_MAX_OVERSHOOT = 1.0  # Pixels; maximum error of the inverse distortion at the border.


class Rectifier:
    """Converts the pictures of one camera to pinhole pictures.

    The undistortion maps are computed for the first picture and cached.

    Args:
        lens: Lens of the pictures on disk.
        downscale: Factor by which pictures are downscaled, by averaging blocks of pixels.
            Incomplete blocks at the right and bottom borders are dropped.

    Attributes:
        source_lens: Lens of the pictures on disk.
        lens: Pinhole lens of the resulting pictures.

    Raises:
        UnsupportedCameraError: The field of view is too wide for a pinhole camera.
        DownscaleError: `downscale` is larger than the width or height.
    """

    def __init__(self, lens: Lens, downscale: int = 1) -> None:
        self.source_lens = lens
        self._pinhole = lens if lens.is_pinhole else _fit_pinhole(lens)
        self.lens = downscale_camera(self._pinhole, downscale)
        self._downscale = downscale
        self._maps: tuple[cv2.typing.MatLike, cv2.typing.MatLike] | None = None

    def rectify(self, picture: Image) -> Image:
        """Undistort and downscale a picture; return one with the lens `lens`.

        Args:
            picture: `[H, W, 3]` sRGB, or `[H, W]` alpha, with the lens `source_lens`.
        """
        if self._pinhole is not self.source_lens:
            border = cv2.BORDER_REPLICATE  # The filter also reads pixels outside the picture.
            undistorted = cv2.remap(picture, *self._get_maps(), cv2.INTER_CUBIC, borderMode=border)
            picture = _as_image(undistorted)
        if self._downscale == 1:
            return picture
        cropped = picture[: self.lens.height * self._downscale, : self.lens.width * self._downscale]
        size = (self.lens.width, self.lens.height)
        return _as_image(cv2.resize(cropped, size, interpolation=cv2.INTER_AREA))

    def rectify_mask(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Undistort and downscale a mask; a pixel is true if all its source pixels are true.

        Args:
            mask: `[H, W]` mask of a picture with the lens `source_lens`.
        """
        levels = np.where(mask, np.uint8(255), np.uint8(0))
        if self._pinhole is not self.source_lens:
            levels = _as_image(cv2.remap(levels, *self._get_maps(), cv2.INTER_LINEAR))
        block_size, height, width = self._downscale, self.lens.height, self.lens.width
        blocks = levels[: height * block_size, : width * block_size].reshape(
            height, block_size, width, block_size
        )
        return np.asarray((blocks >= _MASK_THRESHOLD).all(axis=(1, 3)))

    def _get_maps(self) -> tuple[cv2.typing.MatLike, cv2.typing.MatLike]:
        if self._maps is None:
            self._maps = _map_pixels(self.source_lens, self._pinhole)
        return self._maps


def make_rotation_matrix(vector: Float64Array) -> Float64Array:
    """Return the `[3, 3]` rotation about a `[3]` vector by the vector's length in radians."""
    return np.asarray(cv2.Rodrigues(vector)[0], dtype=np.float64)


def _fit_pinhole(lens: Lens) -> Lens:
    """Return the widest pinhole lens of the same size that sees no pixel outside the picture."""
    left, right = _undistort_borders(lens, axis=0)
    top, bottom = _undistort_borders(lens, axis=1)
    max_tangent = max(map(abs, (left, right, top, bottom)))
    if not (right > left and bottom > top and max_tangent < _MAX_HALF_FIELD_TANGENT):
        message = (
            "the field of view is too wide for a pinhole camera: crop the pictures, or remove "
            "the camera"
        )
        raise UnsupportedCameraError(message)
    fx, fy = (lens.width - 1) / (right - left), (lens.height - 1) / (bottom - top)
    cx, cy = 0.5 - left * fx, 0.5 - top * fy
    pinhole = Lens(lens.width, lens.height, fx, fy, cx, cy)
    _require_inside_picture(lens, pinhole)
    return pinhole


def _undistort_borders(lens: Lens, axis: int) -> tuple[float, float]:
    """Return the largest interval, at depth 1, inside two opposite undistorted borders.

    Args:
        lens: A lens with distortion.
        axis: 0 for x, between the left and right borders; 1 for y, between the top and bottom
            borders.
    """
    size = (lens.width, lens.height)
    border_positions = np.arange(size[1 - axis], dtype=np.float64)
    borders = []
    for border_coordinate in (0.0, size[axis] - 1.0):
        pixels = np.empty((border_positions.size, 1, 2))
        pixels[:, 0, axis], pixels[:, 0, 1 - axis] = border_coordinate, border_positions
        borders.append(_undistort_pixels(lens, pixels)[:, 0, axis])
    return float(borders[0].max()), float(borders[1].min())


def _undistort_pixels(lens: Lens, pixels: Float64Array) -> Float64Array:
    """Undistort `[n, 1, 2]` pixels, and return their `[n, 1, 2]` positions at depth 1."""
    matrix, coefficients = _make_intrinsic_matrix(lens), _pad_coefficients(lens)
    if lens.fisheye:
        directions = cv2.fisheye.undistortPoints(
            pixels, matrix, coefficients, criteria=_STOP_CRITERIA
        )
        return np.asarray(directions, dtype=np.float64)
    undistorted = cv2.undistortImagePoints(pixels, matrix, coefficients, arg1=_STOP_CRITERIA)
    focal_lengths, principal_point = np.array([lens.fx, lens.fy]), matrix[:2, 2]
    return np.asarray((undistorted - principal_point) / focal_lengths, dtype=np.float64)


def _require_inside_picture(lens: Lens, pinhole: Lens) -> None:
    """Check that undistortion has converged: the pinhole's border is inside the picture."""
    columns, rows = _map_pixels(lens, pinhole, cv2.CV_32FC1)
    is_border = np.ones(columns.shape, dtype=bool)
    is_border[1:-1, 1:-1] = False
    overshoots = [
        max(-values[is_border].min(), values[is_border].max() - (size - 1))
        for values, size in ((columns, lens.width), (rows, lens.height))
    ]
    if not max(overshoots) <= _MAX_OVERSHOOT:
        message = (
            "the distortion cannot be inverted: the coefficients do not fit a lens with this "
            "picture size"
        )
        raise UnsupportedCameraError(message)


def _map_pixels(
    lens: Lens, pinhole: Lens, map_type: int = cv2.CV_16SC2
) -> tuple[cv2.typing.MatLike, cv2.typing.MatLike]:
    """Return the maps for cv2.remap: the distorted position of each pinhole pixel."""
    make_maps = cv2.fisheye.initUndistortRectifyMap if lens.fisheye else cv2.initUndistortRectifyMap
    size = (pinhole.width, pinhole.height)
    return make_maps(
        _make_intrinsic_matrix(lens),
        _pad_coefficients(lens),
        np.eye(3),
        _make_intrinsic_matrix(pinhole),
        size,
        map_type,
    )


def _make_intrinsic_matrix(lens: Lens) -> Float64Array:
    return np.array([[lens.fx, 0, lens.cx - 0.5], [0, lens.fy, lens.cy - 0.5], [0, 0, 1]])


def _pad_coefficients(lens: Lens) -> Float64Array:
    """Return `[4]` (fisheye) or `[8]` distortion coefficients, padded with zeros."""
    padded = np.zeros(4 if lens.fisheye else 8)
    padded[: len(lens.coefficients)] = lens.coefficients
    return padded


def _as_image(picture: cv2.typing.MatLike) -> Image:
    return np.asarray(picture, dtype=np.uint8)
