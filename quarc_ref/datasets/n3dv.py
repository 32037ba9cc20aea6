"""Captures as Neural 3D Video lays them out: `camNN.mp4` and `poses_bounds.npy`.

Row i of the poses belongs to the i-th video in the order of the names, and the
numbers of the cameras may have gaps. A row is a 3x5 matrix [R | t | (H, W, f)]
and two depths, near and far; R maps camera to world, and its columns point
down, right and backwards. `points3D*.ply`, if it is there, holds points.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np

from quarc_ref.datasets.calibration import CalibratedCamera, Lens, Numbers, make_pose
from quarc_ref.datasets.errors import (
    CountMismatchError,
    MissingCameraError,
    MissingFileError,
    UnreadablePoseError,
)
from quarc_ref.datasets.footage import CaptureFiles, Footage, natural_order
from quarc_ref.datasets.pictures import VideoPictures
from quarc_ref.datasets.points_ply import read_points_ply
from quarc_ref.datasets.video import VideoReader

POSES_NAME = "poses_bounds.npy"
_ROW_LENGTH = 17
_POINTS_NAME = "points3D_init.ply"


def read_n3dv(folder: Path) -> Footage:
    """Return what a folder of the layout holds.

    Args:
        folder: With `poses_bounds.npy` in it.

    Raises:
        CaptureError: A file is missing or malformed, or they do not fit together.
    """
    poses_path = folder / POSES_NAME
    rows = _read_rows(poses_path)
    video_paths = _list_videos(folder)
    if len(rows) != len(video_paths):
        message = f"{poses_path} has {len(rows)} poses, but there are {len(video_paths)} cam*.mp4"
        raise CountMismatchError(message)
    videos = VideoPictures([VideoReader(path) for path in video_paths])
    points_path = _find_points(folder)
    return Footage(
        cameras=tuple(
            _make_camera(*pair, poses_path) for pair in zip(videos.readers, rows, strict=True)
        ),
        frame_count=videos.frame_count,
        frames_per_second=videos.frames_per_second,
        points=read_points_ply(points_path) if points_path else None,
        source=videos,
        files=CaptureFiles(
            descriptions=(poses_path, points_path) if points_path else (poses_path,),
            pictures=tuple(video_paths),
            sampled=tuple(video_paths),
        ),
        uneven=videos.uneven,
    )


def _list_videos(folder: Path) -> list[Path]:
    paths = sorted(folder.glob("cam*.mp4"))
    if not paths:
        message = f"{folder} has no cam*.mp4 beside {POSES_NAME}"
        raise MissingFileError(message)
    for first, second in pairwise(paths):
        if natural_order(first.stem) > natural_order(second.stem):
            message = (
                f"{first.name} sorts before {second.name}, so that which pose is whose is not "
                f"clear: pad the numbers in {folder} with zeros, in the order of the poses"
            )
            raise MissingCameraError(message)
    return paths


def _find_points(folder: Path) -> Path | None:
    if (folder / _POINTS_NAME).is_file():
        return folder / _POINTS_NAME
    return next(iter(sorted(folder.glob("points3D*.ply"))), None)


def _read_rows(path: Path) -> Numbers:
    """Return `[N, 17]` the rows of the file, finite."""
    try:
        # A map of the file shows its size before anything is allocated.
        stored = np.load(path, mmap_mode="r", allow_pickle=False)
    except FileNotFoundError as error:
        message = f"{path} is missing"
        raise MissingFileError(message) from error
    except Exception as error:  # numpy passes on whatever its parser of headers raises
        message = f"{path} is no array of numbers ({error}): save it again by numpy.save"
        raise UnreadablePoseError(message) from error
    if not isinstance(stored, np.ndarray) or stored.dtype.kind not in "fiu":
        message = f"{path} is no array of numbers: save it again by numpy.save"
        raise UnreadablePoseError(message)
    if stored.ndim != 2 or stored.shape[1] != _ROW_LENGTH or not len(stored):
        message = f"{path} is an array of {stored.shape}, not of one row of 17 to a camera"
        raise UnreadablePoseError(message)
    rows = np.array(stored, dtype=np.float64)
    if not np.isfinite(rows).all():
        message = f"row {int(np.argwhere(~np.isfinite(rows))[0, 0])} of {path} is not finite"
        raise UnreadablePoseError(message)
    return rows


def _make_camera(reader: VideoReader, row: Numbers, path: Path) -> CalibratedCamera:
    """Return the camera that a row describes.

    Args:
        reader: The camera's video.
        row: `[17]` of the poses.
        path: Of the poses, for messages.
    """
    name = reader.path.stem
    matrix = row[: _ROW_LENGTH - 2].reshape(3, 5)
    down, right, backwards, center, (pose_height, pose_width, focal) = matrix.T
    try:
        scale = _measure_resize((pose_width, pose_height), (reader.width, reader.height))
        lens = Lens(
            width=reader.width,
            height=reader.height,
            fx=float(focal) * scale,
            fy=float(focal) * scale,
            cx=reader.width / 2,
            cy=reader.height / 2,
        )
        pose = make_pose(np.stack([right, down, -backwards], axis=1), center)
        near = _require_near(*map(float, row[-2:]))
    except ValueError as error:
        message = f"{path}: camera {name}: {error}"
        raise UnreadablePoseError(message) from error
    return CalibratedCamera(name, lens, pose, near)


def _measure_resize(pose_size: tuple[float, float], video_size: tuple[int, int]) -> float:
    """Return how many times larger the video is than the pictures that the pose is for."""
    (pose_width, pose_height), (width, height) = pose_size, video_size
    least, most = sorted((pose_width, float(width)))
    if least <= 0 or most % least or width * pose_height != height * pose_width:
        message = (
            f"the pose is for pictures of {pose_width:g}x{pose_height:g}, and the video is "
            f"{width}x{height}, which is no whole number of times larger or smaller"
        )
        raise ValueError(message)
    return float(width / pose_width)


def _require_near(near: float, far: float) -> float:
    if not 0 < near < far:
        message = f"the depths {near:g} and {far:g} are not a near and a far one"
        raise ValueError(message)
    return near
