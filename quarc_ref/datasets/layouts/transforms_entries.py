"""Parses and checks nerfstudio's `transforms.json`.

The file has default intrinsics, which an entry can override. Every entry has a path and a pose, and
may have a time. Matrices map camera to world with OpenGL's axes: right, up, backwards. In the files
of Blender scenes and instant-ngp, angles of view can replace the focal lengths, paths can lack the
suffix `.png`, and the picture size can be that of the first picture.
"""

import json
import math
from collections import ChainMap
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from quarc_ref.datasets.arrangements import STILL_SUFFIXES
from quarc_ref.datasets.calibration import Lens, Pose, make_pose
from quarc_ref.datasets.errors import (
    MissingFileError,
    UnreadablePoseError,
    UnsupportedCameraError,
)
from quarc_ref.datasets.media import read_still_size
from quarc_ref.datasets.named_files import NamedFileResolver

_FISHEYE_MODEL = "OPENCV_FISHEYE"
_LAST_ROW, _LAST_ROW_TOLERANCE = [0.0, 0.0, 0.0, 1.0], 1e-6
_COEFFICIENT_NAMES = {
    **dict.fromkeys(
        ("SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"),
        ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    ),
    _FISHEYE_MODEL: ("k1", "k2", "k3", "k4"),
}


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of `transforms.json`: a picture or a video.

    Attributes:
        path: Path of the picture or video as stored in the file, relative to the file's folder.
        lens: Lens of the picture.
        camera_to_world: 3x4 matrix from camera to world with OpenGL's axes, row by row.
        time: Time of the picture in any unit; None if the entry has no time.
        mask_path: Path of the mask; None if the entry has no mask.
    """

    path: str
    lens: Lens
    camera_to_world: tuple[float, ...]
    time: float | None
    mask_path: str | None = None

    def pose(self) -> Pose:
        """Return the pose with OpenCV's axes: right, down, forward.

        Raises:
            ValueError: The matrix is not a valid pose.
        """
        right, up, backwards, center = np.array(self.camera_to_world).reshape(3, 4).T
        return make_pose(np.stack([right, -up, -backwards], axis=1), center)


@dataclass(frozen=True, slots=True)
class Transforms:
    """Parsed contents of a `transforms.json`.

    Attributes:
        entries: Entries in the order of the file, at least one.
        frames_per_second: Frame rate; None if the file has no frame rate.
        points_path: Path of the initial points as stored in the file; None if the file has none.
    """

    entries: tuple[Entry, ...]
    frames_per_second: float | None
    points_path: str | None


def read_transforms(path: Path) -> Transforms:
    """Read and parse a `transforms.json`.

    Raises:
        MissingFileError: The file cannot be read.
        UnreadablePoseError: The file is malformed, or a required number is missing.
        CaptureError: The file states no picture size, and the first picture cannot be read.
        UnsupportedCameraError: The camera model is not supported.
    """
    try:
        return _parse_document(json.loads(path.read_bytes()), path)
    except OSError as error:
        raise MissingFileError.of(path, error) from error
    except (OverflowError, RecursionError, TypeError, ValueError) as error:
        message = f"{path} is not a valid transforms.json of nerfstudio: {error}"
        raise UnreadablePoseError(message) from error


def _parse_document(document: object, path: Path) -> Transforms:
    if not isinstance(document, dict) or not isinstance(document.get("frames"), list):
        message = "the file has no list 'frames'"
        raise TypeError(message)
    entries, defaults = [], document
    for index, frame in enumerate(document["frames"]):
        if not isinstance(frame, dict):
            message = f"item {index} of 'frames' is not an object"
            raise TypeError(message)
        if index == 0:
            defaults = _add_size(document, frame, path)
        entries.append(_parse_entry(frame, defaults))
    if not entries:
        message = "the list 'frames' is empty"
        raise ValueError(message)
    frame_rate = _get_number(document, "fps") if "fps" in document else None
    if frame_rate is not None and frame_rate <= 0:
        message = f"'fps' is {frame_rate:g}, but it must be positive"
        raise ValueError(message)
    points_path = _get_text(document, "ply_file_path") if "ply_file_path" in document else None
    return Transforms(tuple(entries), frame_rate, points_path)


def _add_size(
    defaults: dict[str, object], first_frame: dict[str, object], path: Path
) -> dict[str, object]:
    """Return the shared values, with the size of the first picture if no size is stated."""
    values, name = ChainMap(first_frame, defaults), _get_path(first_frame)
    if "w" in values or "h" in values or PurePosixPath(name).suffix.lower() not in STILL_SUFFIXES:
        return defaults
    width, height = read_still_size(NamedFileResolver(path).find(name))
    return {**defaults, "w": width, "h": height}


def _get_path(frame: dict[str, object]) -> str:
    path = _get_text(frame, "file_path")
    return path if PurePosixPath(path).suffix else f"{path}.png"


def _parse_entry(frame: dict[str, object], defaults: dict[str, object]) -> Entry:
    path = _get_path(frame)
    try:
        time = _get_number(frame, "time") if "time" in frame else None
        mask_path = _get_text(frame, "mask_path") if "mask_path" in frame else None
        lens = _parse_lens(ChainMap(frame, defaults))
        return Entry(path, lens, _parse_matrix(frame), time, mask_path)
    except (TypeError, ValueError) as error:
        message = f"frame {path}: {error}"
        raise ValueError(message) from error


def _parse_matrix(values: Mapping[str, object]) -> tuple[float, ...]:
    """Return the first three rows of `transform_matrix` as 12 numbers."""
    matrix = np.array(values.get("transform_matrix"), dtype=np.float64)
    if matrix.shape not in ((4, 4), (3, 4)):
        message = "'transform_matrix' is not 4x4"
        raise ValueError(message)
    if not np.allclose(matrix[3:], _LAST_ROW, rtol=0, atol=_LAST_ROW_TOLERANCE):
        message = (
            f"the last row of 'transform_matrix' is {matrix[3].tolist()}, but it must be "
            f"{_LAST_ROW}: the matrix may be transposed"
        )
        raise ValueError(message)
    return tuple(matrix[:3].ravel().tolist())


def _parse_lens(values: Mapping[str, object]) -> Lens:
    default_model = _FISHEYE_MODEL if values.get("is_fisheye") else "OPENCV"  # as instant-ngp
    model = values.get("camera_model", default_model)
    if model not in _COEFFICIENT_NAMES:
        message = (
            f"camera model {model} is not supported; use one of {', '.join(_COEFFICIENT_NAMES)}"
        )
        raise UnsupportedCameraError(message)
    width, height = _get_number(values, "w"), _get_number(values, "h")
    if not (width.is_integer() and height.is_integer()):
        message = f"the picture width or height is not a whole number: {width}x{height}"
        raise ValueError(message)
    coefficients = [
        _get_number(values, name) if name in values else 0.0 for name in _COEFFICIENT_NAMES[model]
    ]
    fx, fy, cx, cy = _parse_pinhole(values, width, height)
    return Lens(
        width=int(width),
        height=int(height),
        fx=fx,
        fy=fy,
        cx=cx,
        cy=cy,
        coefficients=tuple(coefficients),
        fisheye=model == _FISHEYE_MODEL,
    )


def _parse_pinhole(
    values: Mapping[str, object], width: float, height: float
) -> tuple[float, float, float, float]:
    """Return fl_x, fl_y, cx and cy in pixels.

    Without `fl_x`, they follow from `camera_angle_x`. Pixels are then square unless there is a
    `camera_angle_y`, and the principal point is the center unless it is given.
    """
    if "fl_x" in values or "camera_angle_x" not in values:
        return (
            _get_number(values, "fl_x"),
            _get_number(values, "fl_y"),
            _get_number(values, "cx"),
            _get_number(values, "cy"),
        )
    fx = fy = _focal_length(values, "camera_angle_x", width)
    if "camera_angle_y" in values:
        fy = _focal_length(values, "camera_angle_y", height)
    cx = _get_number(values, "cx") if "cx" in values else width / 2
    cy = _get_number(values, "cy") if "cy" in values else height / 2
    return fx, fy, cx, cy


def _focal_length(values: Mapping[str, object], key: str, size: float) -> float:
    """Return the focal length in pixels, from the angle in radians that `size` pixels cover."""
    angle = _get_number(values, key)
    if not 0 < angle < math.pi:
        message = f"'{key}' is {angle:g}, but it must be an angle between 0 and pi radians"
        raise ValueError(message)
    return size / (2 * math.tan(angle / 2))


def _get_number(values: Mapping[str, object], key: str) -> float:
    value = values.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        message = f"'{key}' is missing, or not a number"
        raise TypeError(message)
    return float(value)


def _get_text(values: Mapping[str, object], key: str) -> str:
    value = values.get(key)
    if not isinstance(value, str):
        message = f"'{key}' is missing, or not a string"
        raise TypeError(message)
    return value
