"""Captures calibrated by COLMAP: a model, and `frames/NNNN/<camera>.png` or `.jpg`.

The model is in `sparse/0`, in `sparse`, or in the folder itself, binary or
text, and holds one image to a camera: cameras stand still. A lens may be bent,
as in MeetRoom; its pictures are straightened as they are read. Pictures of
cameras that the model does not know are left alone.
"""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pycolmap

from quarc_ref.datasets.calibration import CalibratedCamera, Lens, choose_near, make_pose
from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.colmap_sizes import require_whole
from quarc_ref.datasets.errors import (
    CountMismatchError,
    MissingCameraError,
    MissingFileError,
    UnreadablePoseError,
    UnsupportedCameraError,
)
from quarc_ref.datasets.footage import (
    USUAL_FRAMES_PER_SECOND,
    CaptureFiles,
    Footage,
    natural_order,
)
from quarc_ref.datasets.pictures import FilePictures

_SUFFIXES = (".png", ".jpg", ".jpeg")
# Parameters after the principal point are the first of OpenCV's, in its order.
_MODELS = {
    pycolmap.CameraModelId.SIMPLE_PINHOLE,
    pycolmap.CameraModelId.PINHOLE,
    pycolmap.CameraModelId.SIMPLE_RADIAL,
    pycolmap.CameraModelId.RADIAL,
    pycolmap.CameraModelId.OPENCV,
    pycolmap.CameraModelId.FULL_OPENCV,
    pycolmap.CameraModelId.OPENCV_FISHEYE,
}


def find_model(folder: Path) -> Path | None:
    """Return the folder of the COLMAP model of a capture, if there is one."""
    candidates = [*sorted(folder.glob("sparse*/0")), *sorted(folder.glob("sparse*")), folder]
    names = ("cameras.bin", "cameras.txt")
    with_cameras = (c for c in candidates if any((c / name).is_file() for name in names))
    return next(with_cameras, None)


def read_colmap(folder: Path, model_folder: Path) -> Footage:
    """Return what a folder of the layout holds.

    Args:
        folder: With `frames` in it.
        model_folder: As `find_model` finds it.

    Raises:
        CaptureError: A file is missing or malformed, or they do not fit together.
    """
    cameras, points = _read_model(model_folder)
    frames = _list_frames(folder / "frames")
    paths = [[_find_picture(frame, camera.name) for frame in frames] for camera in cameras]
    return Footage(
        cameras=cameras,
        frame_count=len(frames),
        frames_per_second=USUAL_FRAMES_PER_SECOND,
        points=points,
        source=FilePictures(paths, [camera.lens for camera in cameras]),
        files=CaptureFiles(
            descriptions=tuple(
                path for path in model_folder.iterdir() if path.suffix in (".bin", ".txt")
            ),
            pictures=tuple(path for row in paths for path in row),
            sampled=tuple(row[0] for row in paths),
        ),
    )


def _read_model(folder: Path) -> tuple[tuple[CalibratedCamera, ...], Points | None]:
    """Return the cameras of a model in the order of their names, and its points, if any."""
    try:
        require_whole(folder)
        model = pycolmap.Reconstruction(folder)
        points = _make_points(model)
        images = _name_images(model)
        names = sorted(images, key=natural_order)
        return tuple(_make_camera(name, images[name], model) for name in names), points
    except (LookupError, MemoryError, OSError, RuntimeError, ValueError) as error:
        message = f"{folder} is no COLMAP model that can be used: {error}"
        raise UnreadablePoseError(message) from error


def _name_images(model: pycolmap.Reconstruction) -> dict[str, pycolmap.Image]:
    """Return the images that have a pose, by the name of their camera.

    That is the stem of the image's file (`cam00.png`), or its first folder
    (`cam00/0000.png`) where stems repeat.
    """
    images = [image for image in model.images.values() if image.has_pose]
    stems = [Path(image.name).stem for image in images]
    folders = [Path(image.name).parts[0] for image in images]
    for names in (stems, folders):
        if names and len(set(names)) == len(names):
            return dict(zip(names, images, strict=True))
    message = f"it must hold one image to a camera, named after it, but has {sorted(stems)}"
    raise ValueError(message)


def _list_frames(folder: Path) -> list[Path]:
    """Return the folders of the frames in their order, which has no gap."""
    frames = sorted((p for p in folder.glob("*") if p.name.isdecimal()), key=lambda p: int(p.name))
    if not frames:
        message = f"{folder} has no folder of a frame, such as 0000"
        raise MissingFileError(message)
    for first, second in pairwise(frames):
        if int(second.name) != int(first.name) + 1:
            message = f"{folder} goes from {first.name} to {second.name}: frames are missing"
            raise CountMismatchError(message)
    return frames


def _find_picture(frame: Path, name: str) -> Path:
    for suffix in _SUFFIXES:
        path = frame / f"{name}{suffix}"
        if path.is_file():
            return path
    message = f"frame {frame} has no picture of camera {name}, such as {name}.png"
    raise MissingCameraError(message)


def _make_camera(
    name: str, image: pycolmap.Image, model: pycolmap.Reconstruction
) -> CalibratedCamera:
    camera_from_world = image.cam_from_world()
    axes = camera_from_world.rotation.matrix().T
    with np.errstate(over="ignore", invalid="ignore"):
        center = -axes @ camera_from_world.translation
    pose = make_pose(axes, center)
    seen = [point.point3D_id for point in image.points2D if point.has_point3D()]
    positions = np.array([model.points3D[index].xyz for index in seen]).reshape(-1, 3)
    depths = positions @ pose.rotation[2] + pose.translation[2]
    depths = depths[depths > 0]
    near = choose_near(depths) if depths.size else None
    return CalibratedCamera(name, _make_lens(name, model.cameras[image.camera_id]), pose, near)


def _make_lens(name: str, camera: pycolmap.Camera) -> Lens:
    if camera.model not in _MODELS:
        message = (
            f"camera {name} is a {camera.model.name}: undistort its pictures by COLMAP first, or "
            f"use one of {', '.join(sorted(model.name for model in _MODELS))}"
        )
        raise UnsupportedCameraError(message)
    return Lens(
        width=camera.width,
        height=camera.height,
        fx=camera.focal_length_x,
        fy=camera.focal_length_y,
        cx=camera.principal_point_x,
        cy=camera.principal_point_y,
        coefficients=tuple(float(camera.params[i]) for i in camera.extra_params_idxs()),
        fisheye=camera.model == pycolmap.CameraModelId.OPENCV_FISHEYE,
    )


def _make_points(model: pycolmap.Reconstruction) -> Points | None:
    """Return the model's points, None if it has none."""
    points: Sequence[pycolmap.Point3D] = [model.points3D[i] for i in sorted(model.points3D)]
    if not points:
        return None
    with np.errstate(over="ignore"):
        positions = np.array([point.xyz for point in points]).astype(np.float32)
    if not np.isfinite(positions).all():
        message = "a point of it is not finite"
        raise ValueError(message)
    return Points(positions, np.array([point.color for point in points], dtype=np.uint8))
