"""Writes a calibrated rig as a capture in nerfstudio's layout.

    CAPTURE/transforms.json         lenses and poses
            points3D.ply            points of frame 0
            quarc-capture.json      offsets, up and scale (`datasets.capture_notes`)
            cam00.mp4, ...          the recordings of the calibrated cameras
            cam00/000000.png, ...   the same, for recordings that consist of pictures

Recordings are hard-linked if the file system supports hard links, and copied otherwise.
"""

import json

import numpy as np

from quarc_ref.calibration.calibrate import Calibration
from quarc_ref.datasets.arrangements import is_video
from quarc_ref.datasets.calibration import CalibratedCamera, Lens
from quarc_ref.datasets.capture_notes import NOTES_NAME
from quarc_ref.datasets.notes_file import write_capture_notes
from quarc_ref.datasets.points_ply import write_points_ply
from quarc_ref.files import OutputFolder

_POINTS_NAME = "points3D.ply"
_COEFFICIENT_NAMES = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_FISHEYE_COEFFICIENT_NAMES = ("k1", "k2", "k3", "k4")

JsonObject = dict[str, object]


def write_capture(calibration: Calibration, folder: OutputFolder) -> None:
    """Write a capture.

    Args:
        calibration: Calibration to write; cameras without a pose are omitted.
        folder: Output folder.

    Raises:
        OSError: A file cannot be read or written.
    """
    entries = [
        entry
        for camera in calibration.world.cameras
        for entry in _add_recording(camera, calibration, folder)
    ]
    frame_rate = calibration.recordings.frames_per_second
    document = {"fps": frame_rate, "ply_file_path": _POINTS_NAME, "frames": entries}
    folder.write("transforms.json", json.dumps(document, indent=1, allow_nan=False).encode())
    write_points_ply(folder.register(_POINTS_NAME), calibration.points)
    write_capture_notes(folder.register(NOTES_NAME), calibration.notes)


def _add_recording(
    camera: CalibratedCamera, calibration: Calibration, folder: OutputFolder
) -> list[JsonObject]:
    """Add the recording of a camera to the folder; return its entries in `transforms.json`."""
    paths = calibration.recordings.pictures.paths[calibration.recordings.index(camera.name)]
    camera_entry = _make_entry(camera)
    if len(paths) == 1 and is_video(paths[0]):
        name = f"{camera.name}{paths[0].suffix}"
        folder.link(name, paths[0])
        return [{"file_path": name, **camera_entry}]
    entries: list[JsonObject] = []
    with folder.create_subfolder(camera.name) as subfolder:
        for frame, path in enumerate(paths):
            name = f"{frame:06d}{path.suffix}"
            subfolder.link(name, path)
            entries.append({"file_path": f"{camera.name}/{name}", "time": frame, **camera_entry})
    return entries


def _make_entry(camera: CalibratedCamera) -> JsonObject:
    """Return the lens and pose of a camera as an entry of `transforms.json`."""
    right, down, forward = camera.pose.rotation
    center = -camera.pose.rotation.T @ camera.pose.translation
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, -down, -forward, center], axis=1)  # axes of OpenGL
    return {**_make_lens_entry(camera.lens), "transform_matrix": matrix.tolist()}


def _make_lens_entry(lens: Lens) -> JsonObject:
    names = _FISHEYE_COEFFICIENT_NAMES if lens.fisheye else _COEFFICIENT_NAMES
    return {
        "camera_model": "OPENCV_FISHEYE" if lens.fisheye else "OPENCV",
        "w": lens.width,
        "h": lens.height,
        "fl_x": lens.fx,
        "fl_y": lens.fy,
        "cx": lens.cx,
        "cy": lens.cy,
        **dict(zip(names, lens.coefficients, strict=False)),
    }
