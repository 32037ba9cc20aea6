"""Pose and lens of a camera, as the loaders of all capture layouts return them.

Loaders convert files to `CalibratedCamera`s. `open_capture` replaces every lens with a pinhole
lens, and converts the results to `Camera`s. Camera axes are those of OpenCV (x right, y down, z
forward). Pixel centers are at +0.5, and principal points use the same convention. Code that calls
OpenCV or reads OpenGL poses converts between the conventions.
"""

import math
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quarc_ref.datasets.errors import UnreadablePointsError, UnreadablePoseError
from quarc_ref.format.cameras import Camera

Float64Array = NDArray[np.float64]

_ORTHONORMAL_TOLERANCE = 1e-3  # Poses are often stored with four digits.
# The declared size of a picture determines allocations before the picture is read.
_MAX_SIDE = (1 << 15) - 1  # limit of cv2.remap
_MAX_VIDEO_SIDE = 1 << 14  # limit of x264
MAX_PIXELS = 1 << 27
_NEAR_QUANTILE = 0.01


def require_picture_size(width: int, height: int) -> None:
    """Raise ValueError if pictures are larger than the limits; the message states the limits."""
    _require_size(width, height, _MAX_SIDE, "too large")


def require_video_size(width: int, height: int) -> None:
    """Raise ValueError if pictures are too large for a video; the message states the limits."""
    _require_size(width, height, _MAX_VIDEO_SIDE, "too large for H.264")


def _require_size(width: int, height: int, max_side: int, problem: str) -> None:
    if max(width, height) > max_side or width * height > MAX_PIXELS:
        message = (
            f"pictures of {width} x {height} are {problem}: the limits are {max_side:,} pixels per "
            f"side and {MAX_PIXELS:,} pixels in total"
        )
        raise ValueError(message)


@dataclass(frozen=True, slots=True)
class Lens:
    """Picture size, focal lengths, principal point and distortion of a camera.

    Attributes:
        width: Picture width, pixels.
        height: Picture height, pixels.
        fx: Horizontal focal length, pixels.
        fy: Vertical focal length, pixels.
        cx: Horizontal position of the principal point, pixels.
        cy: Vertical position of the principal point, pixels.
        coefficients: Distortion coefficients, whose trailing zeros may be omitted: k1, k2, p1, p2,
            k3, k4, k5, k6 of OpenCV's radial and tangential model, or k1 to k4 of OpenCV's fisheye
            model.
        fisheye: Whether `coefficients` belong to the fisheye model.

    Raises:
        ValueError: A number is not finite, a size or focal length is not positive, or the
            picture size is too large.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    coefficients: tuple[float, ...] = ()
    fisheye: bool = False

    def __post_init__(self) -> None:
        numbers = (self.fx, self.fy, self.cx, self.cy, *self.coefficients)
        if not all(math.isfinite(number) for number in numbers):
            message = "an intrinsic parameter of the camera is not finite"
            raise ValueError(message)
        if min(self.width, self.height, self.fx, self.fy) <= 0:
            message = "picture sizes and focal lengths must be positive"
            raise ValueError(message)
        require_picture_size(self.width, self.height)

    @property
    def is_pinhole(self) -> bool:
        """Whether the lens has no distortion; a fisheye lens is never a pinhole."""
        return not self.fisheye and not any(self.coefficients)


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """The transformation from world to camera coordinates.

    Attributes:
        rotation: `[3, 3]` rotation from world to camera.
        translation: `[3]` translation from world to camera, world units.
    """

    rotation: Float64Array
    translation: Float64Array


@dataclass(frozen=True, slots=True, eq=False)
class CalibratedCamera:
    """A camera of a capture, before or after undistortion.

    Attributes:
        name: Name of the camera in the capture.
        lens: Lens of the pictures on disk, or the pinhole lens of the undistorted pictures.
        pose: Pose of the camera.
        near: Minimum depth of the scene in world units; None to derive it from the points.
    """

    name: str
    lens: Lens
    pose: Pose
    near: float | None = None


def make_pose(axes: ArrayLike, center: ArrayLike) -> Pose:
    """Return the pose of a camera with the given axes and position in the world.

    Args:
        axes: `[3, 3]` rotation from camera to world; its columns point right, down and forward.
        center: `[3]` position of the camera, world units.

    Returns:
        The pose, with the rotation matrix that is nearest to `axes`.

    Raises:
        ValueError: A number is not finite, or the axes do not form a rotation.
    """
    columns = np.asarray(axes, dtype=np.float64)
    position = np.asarray(center, dtype=np.float64)
    if not (np.isfinite(columns).all() and np.isfinite(position).all()):
        message = "the pose contains a non-finite number"
        raise ValueError(message)
    with np.errstate(over="ignore", invalid="ignore"):
        max_deviation = np.abs(columns.T @ columns - np.eye(3)).max()
    if not max_deviation <= _ORTHONORMAL_TOLERANCE:
        message = "the axes of the pose are not orthonormal"
        raise ValueError(message)
    if np.linalg.det(columns) < 0:
        message = "the axes of the pose are left-handed: an axis is flipped"
        raise ValueError(message)
    left_vectors, _, right_vectors = np.linalg.svd(columns)
    rotation = (left_vectors @ right_vectors).T
    with np.errstate(over="ignore", invalid="ignore"):
        translation = -rotation @ position
    if not np.isfinite(translation).all():
        message = "the coordinates of the camera position are too large"
        raise ValueError(message)
    return Pose(rotation, translation)


def measure_depths(camera: CalibratedCamera, positions: NDArray[np.floating]) -> Float64Array:
    """Return the depths of the points that project into the picture of a pinhole camera.

    Args:
        camera: Camera with a pinhole lens.
        positions: `[P, 3]` points, world units.

    Returns:
        `[V]` depths of the points in front of the camera and inside its picture.
    """
    lens = camera.lens
    x, y, z = (positions @ camera.pose.rotation.T + camera.pose.translation).T
    is_in_front = z > 0
    x, y, z = x[is_in_front], y[is_in_front], z[is_in_front]
    scaled_columns, scaled_rows = lens.fx * x + lens.cx * z, lens.fy * y + lens.cy * z
    is_inside = (
        (scaled_columns >= 0)
        & (scaled_columns <= lens.width * z)
        & (scaled_rows >= 0)
        & (scaled_rows <= lens.height * z)
    )
    depths: Float64Array = z[is_inside]
    return depths


def choose_near(depths: Float64Array) -> float:
    """Return the depth of the near plane: the first percentile of the depths of visible points."""
    return float(np.quantile(depths, _NEAR_QUANTILE))


_Pinhole = TypeVar("_Pinhole", Lens, Camera)


class DownscaleError(ValueError):
    """Pictures cannot be downscaled by the requested factor."""


def downscale_camera(pinhole: _Pinhole, factor: int) -> _Pinhole:
    """Return the lens or camera of pictures that are downscaled by `factor`.

    Raises:
        DownscaleError: The factor is larger than the width or height.
    """
    width, height = pinhole.width, pinhole.height
    if not 1 <= factor <= min(width, height):
        message = f"pictures of {width}x{height} cannot be downscaled by {factor}"
        raise DownscaleError(message)
    return replace(
        pinhole,
        width=width // factor,
        height=height // factor,
        fx=pinhole.fx / factor,
        fy=pinhole.fy / factor,
        cx=pinhole.cx / factor,
        cy=pinhole.cy / factor,
    )


def make_camera(
    camera: CalibratedCamera, positions: NDArray[np.floating], *, held_out: bool = False
) -> Camera:
    """Convert a calibrated camera to a `Camera`, the type that is stored in streams.

    Args:
        camera: Camera with a pinhole lens.
        positions: `[P, 3]` points of the scene, which determine the near plane if the camera has
            none.
        held_out: Whether the camera is held out for evaluation.

    Raises:
        UnreadablePointsError: The camera has no near plane, and sees none of the points.
        UnreadablePoseError: A number of the camera is too large or too small for a stream.
    """
    near = camera.near
    if near is None:
        depths = measure_depths(camera, positions)
        if not depths.size:
            message = (
                f"camera {camera.name} sees none of the {len(positions)} initial points: "
                f"{_suggest_remedy(camera, positions)}"
            )
            raise UnreadablePointsError(message)
        near = choose_near(depths)
    _require_storable(camera, near)
    lens = camera.lens
    return Camera(
        name=camera.name,
        width=lens.width,
        height=lens.height,
        fx=lens.fx,
        fy=lens.fy,
        cx=lens.cx,
        cy=lens.cy,
        rotation=tuple(camera.pose.rotation.ravel().tolist()),
        translation=tuple(camera.pose.translation.tolist()),
        near=near,
        held_out=held_out,
    )


def _suggest_remedy(camera: CalibratedCamera, positions: NDArray[np.floating]) -> str:
    """Return advice about a camera that sees no points."""
    flip = np.diag([1.0, -1.0, -1.0])  # between the axes of OpenGL and OpenCV
    flipped_pose = Pose(flip @ camera.pose.rotation, flip @ camera.pose.translation)
    visible_count = len(measure_depths(replace(camera, pose=flipped_pose), positions))
    if visible_count:
        return (
            f"it would see {visible_count} of them if it looked backwards, so its pose probably "
            "has the axes of another convention; in transforms.json, they are those of OpenGL "
            "(right, up, backwards), and in COLMAP's files those of OpenCV (right, down, forward)"
        )
    return "check its pose, or provide points of the whole scene"


def _require_storable(camera: CalibratedCamera, near: float) -> None:
    """Raise UnreadablePoseError unless a stream can store the camera as binary32 (SPEC 5.6)."""
    lens, translation = camera.lens, camera.pose.translation
    positive_numbers = np.array([lens.fx, lens.fy, near])
    numbers = np.array([*positive_numbers, lens.cx, lens.cy, *translation])
    with np.errstate(over="ignore", under="ignore"):
        is_finite = np.isfinite(numbers.astype(np.float32)).all()
        is_positive = (positive_numbers.astype(np.float32) > 0).all()
    if not (is_finite and is_positive):
        message = (
            f"a number of camera {camera.name} is too large or too small: focal lengths "
            f"{lens.fx:g} and {lens.fy:g}, principal point {lens.cx:g}, {lens.cy:g}, translation "
            f"{', '.join(f'{x:g}' for x in translation)}, near {near:g}; calibrate again, or scale "
            "the capture"
        )
        raise UnreadablePoseError(message)
