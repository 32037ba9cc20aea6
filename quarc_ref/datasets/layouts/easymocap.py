"""Loads captures calibrated by EasyMocap: `intri.yml`, `extri.yml` and pictures or videos.

EasyMocap's documentation describes the layout ("Camera calibration" and "Data preparation",
github.com/zju3dv/EasyMocap). ENeRF-Outdoor and other captures from ZJU also use this layout.
Pictures are stored as `images/00/000000.jpg` or in videos such as `videos/00.mp4`. The YAML files
have the format of OpenCV's FileStorage. The files have a list `names`, and the following matrices
for each camera NAME: `K_NAME` (3x3), `dist_NAME` (k1, k2, p1, p2, k3), `T_NAME` (3), and the
rotation from world to camera as a matrix `Rot_NAME` (3x3) or a vector `R_NAME` (3). Pixel centers
are at whole numbers, as in OpenCV.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from quarc_ref.datasets.arrangements import find_cameras_without_poses, find_pictures
from quarc_ref.datasets.calibration import CalibratedCamera, Float64Array, make_pose
from quarc_ref.datasets.errors import MissingFileError, UnreadablePoseError
from quarc_ref.datasets.footage import Footage
from quarc_ref.datasets.frame_numbers import compare_first_numbers
from quarc_ref.datasets.natural_order import natural_order
from quarc_ref.datasets.opencv_lens import make_opencv_lens
from quarc_ref.datasets.opencv_yaml import Node, parse_yaml
from quarc_ref.datasets.pictures import Size
from quarc_ref.datasets.undistortion import make_rotation_matrix

_MAX_COEFFICIENTS = 8

Matrices = Mapping[str, Node]


def read_easymocap(folder: Path) -> Footage:
    """Load a capture in EasyMocap's layout.

    Args:
        folder: Folder with `intri.yml` and `extri.yml`.

    Raises:
        CaptureError: A file is missing or malformed, or the files are inconsistent.
    """
    paths = (folder / "intri.yml", folder / "extri.yml")
    intrinsics, extrinsics = map(_read_matrices, paths)
    names = _list_names(intrinsics, paths[0])
    source = find_pictures(folder, names)
    cameras = []
    for name, size in zip(names, source.sizes, strict=True):
        try:
            cameras.append(_make_camera(name, size, intrinsics, extrinsics))
        except ValueError as error:
            message = f"{folder}: camera {name} in intri.yml or extri.yml: {error}"
            raise UnreadablePoseError(message) from error
    findings = (
        *find_cameras_without_poses(folder, names, paths[1]),
        *compare_first_numbers(names, source),
    )
    return Footage(tuple(cameras), source, points=None, description_files=paths, findings=findings)


def _read_matrices(path: Path) -> Matrices:
    try:
        return parse_yaml(path.read_bytes())
    except OSError as error:
        raise MissingFileError.of(path, error) from error
    except ValueError as error:
        message = f"{path} is not an EasyMocap calibration: {error}"
        raise UnreadablePoseError(message) from error


def _list_names(intrinsics: Matrices, path: Path) -> list[str]:
    stored_names = intrinsics.get("names")
    names = (
        [str(name) for name in stored_names]
        if isinstance(stored_names, list)
        else [key.removeprefix("K_") for key in intrinsics if key.startswith("K_")]
    )
    if not names or len(set(names)) < len(names):
        message = f"{path} has no list 'names' of distinct camera names"
        raise UnreadablePoseError(message)
    return sorted(names, key=natural_order)


def _make_camera(
    name: str, size: Size, intrinsics: Matrices, extrinsics: Matrices
) -> CalibratedCamera:
    matrix = _get_matrix(intrinsics, f"K_{name}", 9).reshape(3, 3)
    coefficients = intrinsics.get(f"dist_{name}", intrinsics.get(f"D_{name}"))
    distortion = () if not isinstance(coefficients, np.ndarray) else tuple(coefficients.tolist())
    if len(distortion) > _MAX_COEFFICIENTS:
        message = f"dist_{name} has more than {_MAX_COEFFICIENTS} coefficients"
        raise ValueError(message)
    lens = make_opencv_lens(size, matrix, distortion)
    rotation = _read_rotation(name, extrinsics)
    center = -rotation.T @ _get_matrix(extrinsics, f"T_{name}", 3)
    return CalibratedCamera(name, lens, make_pose(rotation.T, center))


def _read_rotation(name: str, extrinsics: Matrices) -> Float64Array:
    """Return a camera's `[3, 3]` rotation from world to camera."""
    if f"Rot_{name}" in extrinsics:
        return _get_matrix(extrinsics, f"Rot_{name}", 9).reshape(3, 3)
    return make_rotation_matrix(_get_matrix(extrinsics, f"R_{name}", 3))


def _get_matrix(matrices: Matrices, key: str, number_count: int) -> Float64Array:
    values = matrices.get(key)
    if not isinstance(values, np.ndarray) or values.size != number_count:
        message = f"{key} is missing, or not a matrix of {number_count} numbers"
        raise ValueError(message)
    if not np.isfinite(values).all():
        message = f"{key} has a non-finite number"
        raise ValueError(message)
    return values
