"""Loads captures calibrated by COLMAP: a COLMAP model, and pictures or videos of its cameras.

The model (colmap.github.io/format.html) consists of binary or text files in `sparse/0`, in
`sparse`, or directly in the capture's folder. The model has one image per camera, because cameras
are static. The module `arrangements` finds the pictures: `images/cam00.png` as in COLMAP,
`images/cam00/0000.png`, `frames/0000/cam00.png`, or videos next to the model. Pictures with lens
distortion are undistorted when they are read. Pictures of cameras that are not in the model are
ignored, with a finding.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from quarc_ref.datasets.arrangements import find_cameras_without_poses, find_pictures
from quarc_ref.datasets.calibration import CalibratedCamera, choose_near, make_pose
from quarc_ref.datasets.capture import Points, require_finite
from quarc_ref.datasets.colmap_cameras import make_lens
from quarc_ref.datasets.colmap_import import pycolmap
from quarc_ref.datasets.errors import MissingFileError, UnreadablePoseError
from quarc_ref.datasets.findings import Finding
from quarc_ref.datasets.footage import Footage
from quarc_ref.datasets.frame_numbers import compare_first_numbers
from quarc_ref.datasets.layouts.colmap_sizes import require_complete_files
from quarc_ref.datasets.natural_order import natural_order
from quarc_ref.datasets.pictures import Pictures


def find_model(folder: Path) -> Path | None:
    """Return the folder of a capture's COLMAP model; None if the capture has no model."""
    candidates = [*sorted(folder.glob("sparse*/0")), *sorted(folder.glob("sparse*")), folder]
    file_names = ("cameras.bin", "cameras.txt")
    model_folders = (
        candidate
        for candidate in candidates
        if any((candidate / name).is_file() for name in file_names)
    )
    return next(model_folders, None)


def read_colmap(folder: Path) -> Footage:
    """Load a capture that COLMAP calibrated.

    Args:
        folder: Folder of the capture, in which `find_model` finds a model.

    Raises:
        CaptureError: A file is missing or malformed, or the files are inconsistent.
    """
    model_folder = find_model(folder)
    if model_folder is None:
        message = f"{folder} has no COLMAP model, such as sparse/0/cameras.bin"
        raise MissingFileError(message)
    camera_sets, points = _read_model(model_folder)
    cameras, source = _find_matching_pictures(folder, camera_sets)
    names = [camera.name for camera in cameras]
    return Footage(
        cameras,
        source,
        points,
        description_files=tuple(
            path
            for path in model_folder.iterdir()
            if path.suffix in (".bin", ".txt") and not path.is_fifo()
        ),
        findings=(
            *find_cameras_without_poses(folder, names, model_folder),
            *compare_first_numbers(names, source),
            *_find_larger_models(model_folder, len(names)),
        ),
    )


def _find_larger_models(model_folder: Path, camera_count: int) -> Iterator[Finding]:
    """Yield a finding if COLMAP made several models, and another one has more images."""
    if not model_folder.name.isdecimal():
        return
    counts = {
        folder: _count_posed_images(folder)
        for folder in sorted(model_folder.parent.iterdir())
        if folder.name.isdecimal() and folder != model_folder
    }
    largest = max(counts, key=lambda folder: counts[folder], default=model_folder)
    if counts.get(largest, 0) > camera_count:
        message = (
            f"{largest} has poses of {counts[largest]} images, and {model_folder}, which is used, "
            f"only of {camera_count}: to use the larger model, exchange the names of the two "
            "folders; to get one model of all cameras, calibrate again with more matches"
        )
        yield Finding("larger-model", message)


def _count_posed_images(folder: Path) -> int:
    """Return the number of images with a pose in a model; 0 if it cannot be read."""
    with suppress(LookupError, MemoryError, OSError, RuntimeError, ValueError):
        require_complete_files(folder)
        model = pycolmap.Reconstruction(folder)
        return sum(image.has_pose for image in model.images.values())
    return 0


_Cameras = tuple[CalibratedCamera, ...]


def _find_matching_pictures(
    folder: Path, camera_sets: Sequence[_Cameras]
) -> tuple[_Cameras, Pictures]:
    """Return the first set of cameras whose names match picture files, and their pictures."""
    first_cameras, *other_sets = camera_sets
    try:
        return first_cameras, find_pictures(folder, [camera.name for camera in first_cameras])
    except MissingFileError:
        for cameras in other_sets:
            with suppress(MissingFileError):
                return cameras, find_pictures(folder, [camera.name for camera in cameras])
        raise


def _read_model(folder: Path) -> tuple[list[_Cameras], Points | None]:
    """Return a model's cameras, one list for each way of naming them, and its points."""
    try:
        require_complete_files(folder)
        model = pycolmap.Reconstruction(folder)
        points = _make_points(model)
        return [_make_cameras(images, model) for images in _name_images(model)], points
    except (LookupError, MemoryError, OSError, RuntimeError, ValueError) as error:
        message = f"{folder} is not a usable COLMAP model: {error}"
        raise UnreadablePoseError(message) from error


def _name_images(model: "pycolmap.Reconstruction") -> "list[dict[str, pycolmap.Image]]":
    """Return the posed images by camera name: one dictionary for each way of naming cameras.

    Cameras are named either after their image files without suffix (`cam00.png`), or after the
    first folders in the images' paths (`cam00/0000.png`). A way that does not give distinct names
    is skipped.
    """
    images = [image for image in model.images.values() if image.has_pose]
    stems = [Path(image.name).stem for image in images]
    folders = [Path(image.name).parts[0] for image in images]
    named_images = [
        dict(zip(names, images, strict=True))
        for names in (stems, folders)
        if names and len(set(names)) == len(names)
    ]
    if not named_images:
        message = (
            "the model must have exactly one image per camera, named after the camera, but its "
            f"images are {sorted(stems)}"
        )
        raise ValueError(message)
    return named_images


def _make_cameras(
    images: "dict[str, pycolmap.Image]", model: "pycolmap.Reconstruction"
) -> _Cameras:
    names = sorted(images, key=natural_order)
    return tuple(_make_camera(name, images[name], model) for name in names)


def _make_camera(
    name: str, image: "pycolmap.Image", model: "pycolmap.Reconstruction"
) -> CalibratedCamera:
    camera_from_world = image.cam_from_world()
    axes = camera_from_world.rotation.matrix().T
    with np.errstate(over="ignore", invalid="ignore"):
        center = -axes @ camera_from_world.translation
    pose = make_pose(axes, center)
    point_ids = [point.point3D_id for point in image.points2D if point.has_point3D()]
    positions = np.array([model.points3D[point_id].xyz for point_id in point_ids]).reshape(-1, 3)
    depths = positions @ pose.rotation[2] + pose.translation[2]
    depths = depths[depths > 0]
    near = choose_near(depths) if depths.size else None
    return CalibratedCamera(name, make_lens(name, model.cameras[image.camera_id]), pose, near)


def _make_points(model: "pycolmap.Reconstruction") -> Points | None:
    """Return the points of a model, or None if it has no points."""
    points: Sequence[pycolmap.Point3D] = [model.points3D[i] for i in sorted(model.points3D)]
    if not points:
        return None
    with np.errstate(over="ignore"):
        positions = np.array([point.xyz for point in points]).astype(np.float32)
    require_finite(positions)
    return Points(positions, np.array([point.color for point in points], dtype=np.uint8))
