"""Loads captures in the layout of Neural 3D Video: `poses_bounds.npy` and videos or pictures.

N3DV, also called DyNeRF (github.com/facebookresearch/Neural_3D_Video), has videos `cam00.mp4`,
`cam01.mp4` and so on, and poses in LLFF's format. Videos named `cam_0.mp4` as in MeetRoom, and
camera folders with pictures (`cam00/0000.png`, `cam00/images/0000.png`) are supported as well.
Row i of the poses file belongs to the i-th camera in the natural order of the names, whose numbers
may have gaps. A row has a 3x5 matrix [R | t | (H, W, f)] and two depths, near and far. R rotates
from camera to world, and its columns point down, right and backwards. `points3D*.ply` is optional
and contains initial points.
"""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from quarc_ref.datasets.arrangements import (
    ARRANGEMENTS,
    Files,
    list_arrangements,
    open_pictures,
)
from quarc_ref.datasets.calibration import CalibratedCamera, Float64Array, Lens, make_pose
from quarc_ref.datasets.errors import (
    CountMismatchError,
    MissingFileError,
    UnreadablePoseError,
)
from quarc_ref.datasets.findings import Finding
from quarc_ref.datasets.footage import Footage
from quarc_ref.datasets.frame_numbers import compare_first_numbers
from quarc_ref.datasets.natural_order import natural_order
from quarc_ref.datasets.orientation import suggest_size_remedy
from quarc_ref.datasets.pictures import Size
from quarc_ref.datasets.points_ply import read_points_ply
from quarc_ref.datasets.unsupported_files import describe_unsupported_files
from quarc_ref.wording import format_count

POSES_NAME = "poses_bounds.npy"
_ROW_LENGTH = 17
_POINTS_NAME = "points3D_init.ply"
_CAMERA_PREFIX = "cam"


def read_n3dv(folder: Path) -> Footage:
    """Load a capture in the layout of Neural 3D Video.

    Args:
        folder: Folder with `poses_bounds.npy`.

    Raises:
        CaptureError: A file is missing or malformed, or the files are inconsistent.
    """
    poses_path = folder / POSES_NAME
    rows = _read_rows(poses_path)
    files = _find_files(folder, len(rows))
    names = sorted(files, key=natural_order)
    source = open_pictures([files[name] for name in names])
    points_path = _find_points(folder)
    return Footage(
        cameras=tuple(
            _make_camera(name, size, rotation, row, poses_path)
            for name, size, rotation, row in zip(
                names, source.sizes, source.rotations, rows, strict=True
            )
        ),
        source=source,
        points=read_points_ply(points_path) if points_path else None,
        description_files=(poses_path, points_path) if points_path else (poses_path,),
        findings=(*_compare_orders(names), *compare_first_numbers(names, source)),
    )


def _find_files(folder: Path, camera_count: int) -> Files:
    """Return the videos or pictures of `camera_count` cameras, by camera name."""
    candidates = []
    for _, listed_files in list_arrangements(folder):
        files = _prefer_camera_prefix(listed_files)
        if len(files) == camera_count:
            return files
        if files:
            candidates.append(files)
    if not candidates:
        patterns = ", ".join(pattern for pattern, _ in ARRANGEMENTS).replace("NAME", "cam00")
        message = (
            f"{folder} has {POSES_NAME}, but no videos or pictures: looked for {patterns}"
            f"{describe_unsupported_files(folder)}"
        )
        raise MissingFileError(message)
    names = max(candidates, key=len)
    remedy = "add the missing videos, or remove the extra poses"
    if len(names) > camera_count:
        remedy = "move the videos without a pose to another folder, or add their poses"
    message = (
        f"{folder / POSES_NAME} has {format_count(camera_count, 'pose')}, but there "
        f"{'is' if len(names) == 1 else 'are'} {format_count(len(names), 'camera')} "
        f"({', '.join(names)}): {remedy}{describe_unsupported_files(folder)}"
    )
    raise CountMismatchError(message)


def _prefer_camera_prefix(files: Files) -> Files:
    """Return the cameras whose names start with `cam`, or all cameras if there are none."""
    prefixed_files = {
        name: paths for name, paths in files.items() if name.startswith(_CAMERA_PREFIX)
    }
    return prefixed_files or files


def _compare_orders(names: Sequence[str]) -> tuple[Finding, ...]:
    """Return a finding if the alphabetical and the numeric order of the names differ."""
    for first, second in pairwise(sorted(names)):
        if natural_order(first) > natural_order(second):
            message = (
                f"row i of {POSES_NAME} is assigned to the i-th camera in numeric order, "
                f"where {second} comes before {first}; if the poses are in alphabetical "
                "order, rename the files so that all numbers have the same number of digits"
            )
            return (Finding("order-of-poses", message),)
    return ()


def _find_points(folder: Path) -> Path | None:
    if (folder / _POINTS_NAME).is_file():
        return folder / _POINTS_NAME
    paths = (path for path in sorted(folder.glob("points3D*.ply")) if not path.is_fifo())
    return next(paths, None)


def _read_rows(path: Path) -> Float64Array:
    """Return the `[N, 17]` rows of the poses file; all numbers are finite."""
    try:
        # Memory-mapping shows the size of the array before anything is allocated.
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except FileNotFoundError as error:
        message = f"{path} is missing"
        raise MissingFileError(message) from error
    except Exception as error:  # numpy does not wrap the exceptions of its header parser
        message = f"{path} is not an array of numbers ({error}): save it again with numpy.save"
        raise UnreadablePoseError(message) from error
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiu":
        message = f"{path} is not an array of numbers: save it again with numpy.save"
        raise UnreadablePoseError(message)
    if array.ndim != 2 or array.shape[1] != _ROW_LENGTH or not len(array):
        message = f"{path} has shape {array.shape}, but must have one row of 17 numbers per camera"
        raise UnreadablePoseError(message)
    rows = np.array(array, dtype=np.float64)
    if not np.isfinite(rows).all():
        row = int(np.argwhere(~np.isfinite(rows))[0, 0])
        message = f"row {row} of {path} contains a number that is not finite"
        raise UnreadablePoseError(message)
    return rows


def _make_camera(
    name: str, size: Size, rotation: int, row: Float64Array, path: Path
) -> CalibratedCamera:
    """Return the camera that a row of the poses file describes.

    Args:
        name: Name of the camera.
        size: Width and height of the camera's pictures, pixels.
        rotation: Rotation flag of the camera's video, degrees.
        row: `[17]` row of the poses file.
        path: Path of the poses file, for error messages.
    """
    width, height = size
    matrix = row[: _ROW_LENGTH - 2].reshape(3, 5)
    down, right, backwards, center, (calibrated_height, calibrated_width, focal) = matrix.T
    try:
        scale = _find_picture_scale((calibrated_width, calibrated_height), size, rotation)
        lens = Lens(
            width=width,
            height=height,
            fx=float(focal) * scale,
            fy=float(focal) * scale,
            cx=width / 2,
            cy=height / 2,
        )
        pose = make_pose(np.stack([right, down, -backwards], axis=1), center)
        near = _require_near(*map(float, row[-2:]))
    except ValueError as error:
        message = f"{path}: camera {name}: {error}"
        raise UnreadablePoseError(message) from error
    return CalibratedCamera(name, lens, pose, near)


def _find_picture_scale(
    calibrated_size: tuple[float, float], video_size: Size, rotation: int
) -> float:
    """Return the width of the video divided by the picture width in the poses file."""
    (calibrated_width, calibrated_height), (width, height) = calibrated_size, video_size
    smaller_width, larger_width = sorted((calibrated_width, float(width)))
    if (
        smaller_width <= 0
        or larger_width % smaller_width
        or width * calibrated_height != height * calibrated_width
    ):
        message = (
            f"the pose is for pictures of {calibrated_width:g}x{calibrated_height:g}, but the "
            f"video is {width}x{height}; the sizes must be equal, or one must be a whole "
            f"multiple of the other: {suggest_size_remedy(video_size, calibrated_size, rotation)}"
        )
        raise ValueError(message)
    return float(width / calibrated_width)


def _require_near(near: float, far: float) -> float:
    if not 0 < near < far:
        message = f"the near depth {near:g} must be positive and less than the far depth {far:g}"
        raise ValueError(message)
    return near
