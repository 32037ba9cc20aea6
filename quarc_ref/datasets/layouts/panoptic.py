"""Loads captures of CMU's Panoptic Studio: `calibration_NAME.json` and HD or VGA recordings.

The Panoptic Toolbox (github.com/CMU-Perceptual-Computing-Lab/panoptic-toolbox) defines the layout.
An HD camera has a video `hdVideos/hd_00_00.mp4`, or pictures `hdImgs/00_00/00_00_00000000.jpg` that
the toolbox extracts. A VGA camera has a video `vgaVideos/vga_01_01.mp4`, or pictures in
`vgaImgs/01_01`. For each camera, the calibration file gives `K`, `distCoef` (k1, k2, p1, p2, k3),
`R` and `t` (world to camera, centimeters) and `resolution`. Pixel centers are at whole numbers, as
in OpenCV. If there are recordings of HD cameras, only these cameras are loaded. If there are no
recordings of HD cameras, the VGA cameras that have recordings are loaded.
"""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from quarc_ref.datasets.arrangements import (
    Files,
    list_picture_folders,
    list_videos,
    open_pictures,
)
from quarc_ref.datasets.calibration import CalibratedCamera, make_pose
from quarc_ref.datasets.errors import CountMismatchError, MissingFileError, UnreadablePoseError
from quarc_ref.datasets.findings import report_missing_poses
from quarc_ref.datasets.footage import Footage
from quarc_ref.datasets.frame_numbers import compare_first_numbers
from quarc_ref.datasets.natural_order import natural_order
from quarc_ref.datasets.opencv_lens import make_opencv_lens

_CAMERA_KINDS = ("hd", "vga")


def read_panoptic(folder: Path) -> Footage:
    """Load a capture in the layout of Panoptic Studio.

    Args:
        folder: Folder with one `calibration_*.json`.

    Raises:
        CaptureError: A file is missing or malformed, or the files are inconsistent.
    """
    path, *other_paths = sorted(folder.glob("calibration_*.json"))
    if other_paths:
        message = f"{folder} has {path.name} and {other_paths[0].name}: keep only one of them"
        raise CountMismatchError(message)
    cameras = read_cameras(path)
    for kind in _CAMERA_KINDS:
        files = _list_files(folder, kind)
        names = sorted(cameras[kind].keys() & files.keys(), key=natural_order)
        if names:
            source = open_pictures([files[name] for name in names])
            return Footage(
                cameras=tuple(cameras[kind][name] for name in names),
                source=source,
                points=None,
                description_files=(path,),
                findings=(
                    *report_missing_poses(sorted(files.keys() - cameras[kind].keys()), path),
                    *compare_first_numbers(names, source),
                ),
            )
    message = (
        f"{folder} has no hdVideos/hd_00_00.mp4, hdImgs/00_00/00_00_00000000.jpg, vgaVideos "
        f"or vgaImgs for the cameras of {path.name}"
    )
    raise MissingFileError(message)


def read_cameras(path: Path) -> dict[str, dict[str, CalibratedCamera]]:
    """Return the cameras in a calibration file, by kind (`hd`, `vga`) and name.

    Raises:
        MissingFileError: The file cannot be read.
        UnreadablePoseError: The file is malformed, or has an invalid pose.
    """
    try:
        document = json.loads(path.read_bytes())
        cameras: dict[str, dict[str, CalibratedCamera]] = {kind: {} for kind in _CAMERA_KINDS}
        for entry in document["cameras"]:
            if entry["type"] in cameras:
                name = str(entry["name"])
                if name in cameras[entry["type"]]:
                    message = f"{path} has two entries of camera {name}: remove one of them"
                    raise UnreadablePoseError(message)
                cameras[entry["type"]][name] = _read_camera(path, name, entry)
    except OSError as error:
        raise MissingFileError.of(path, error) from error
    except (KeyError, OverflowError, RecursionError, TypeError, ValueError) as error:
        message = f"{path} is not a Panoptic Studio calibration: {error!r}"
        raise UnreadablePoseError(message) from error
    return cameras


def _list_files(folder: Path, kind: str) -> Files:
    """Return the videos or pictures by camera name, such as `00_00` in the calibration file."""
    videos = list_videos(folder / f"{kind}Videos")
    videos_by_name = {name.removeprefix(f"{kind}_"): paths for name, paths in videos.items()}
    return videos_by_name or list_picture_folders(folder / f"{kind}Imgs")


def _read_camera(path: Path, name: str, entry: Mapping[str, object]) -> CalibratedCamera:
    try:
        return _make_camera(name, entry)
    except (KeyError, OverflowError, TypeError, ValueError) as error:
        reason = f"{error} is missing" if isinstance(error, KeyError) else error
        message = f"{path}: camera {name}: {reason}"
        raise UnreadablePoseError(message) from error


def _make_camera(name: str, entry: Mapping[str, object]) -> CalibratedCamera:
    def get_array(key: str, *shape: int) -> np.ndarray:
        return np.array(entry[key], dtype=np.float64).reshape(shape)

    width, height = get_array("resolution", 2).astype(np.int64).tolist()
    rotation = get_array("R", 3, 3)
    lens = make_opencv_lens(
        (width, height), get_array("K", 3, 3), get_array("distCoef", 5).tolist()
    )
    return CalibratedCamera(name, lens, make_pose(rotation.T, -rotation.T @ get_array("t", 3)))
