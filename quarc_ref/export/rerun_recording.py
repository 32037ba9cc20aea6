"""Exports frames as a rerun recording (`.rrd`) with splats and cameras on a timeline.

The recording uses the coordinates of the stream and declares its up axis.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from quarc_ref.datasets.camera_geometry import camera_center, rotation_matrix
from quarc_ref.export.activate import (
    compute_base_colors,
    compute_opacities,
    compute_scales,
    convert_to_xyzw,
)
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.format.cameras import Camera

_REST_COEFFICIENT_COUNT = 15  # rerun requires the coefficients of all degrees from 1 to 3


class SequenceExporter:
    """Collects all frames in one recording.

    Args:
        clip: Properties of the stream.
    """

    def __init__(self, clip: Clip) -> None:
        import rerun

        self._clip = clip
        self._folder = TemporaryDirectory()
        self._path = Path(self._folder.name) / "frames.rrd"
        self._recording = recording = rerun.RecordingStream("quarc-ref")
        recording.save(self._path)
        handedness = "RIGHT" if clip.header.right_handed else "LEFT"
        view_coordinates = (
            f"{handedness}_HAND_{clip.up[1].upper()}_{'UP' if clip.up[0] == '+' else 'DOWN'}"
        )
        recording.log("world", getattr(rerun.ViewCoordinates, view_coordinates), static=True)
        for camera in clip.cameras:
            self._add_camera(camera)

    def add(self, frame: Frame) -> None:
        """Append a frame."""
        import rerun

        splats, recording = frame.splats, self._recording
        recording.set_time("frame", sequence=frame.scene.frame)
        recording.set_time("time", duration=self._clip.compute_time(frame.scene.frame))
        colors = np.concatenate(
            [compute_base_colors(splats), compute_opacities(splats)[:, None]], axis=1
        )
        sh_rest = np.zeros((len(colors), _REST_COEFFICIENT_COUNT, 3), dtype=np.float32)
        sh_rest[:, : splats.sh.shape[1] - 1] = splats.sh[:, 1:]
        has_sh_rest = splats.sh.shape[1] > 1
        gaussians = rerun.GaussianSplats3D(
            splats.positions,
            scales=compute_scales(splats),
            quaternions=convert_to_xyzw(splats.rotations),
            colors=np.round(colors * 255).astype(np.uint8),
            sh_coefficients=sh_rest if has_sh_rest else None,
            spherical_harmonics_degree=1 if has_sh_rest else 0,
        )
        recording.log("world/splats", gaussians)

    def finish(self) -> bytes:
        """Build the recording."""
        self._recording.flush()
        self._recording.disconnect()
        with self._folder:
            return self._path.read_bytes()

    def _add_camera(self, camera: Camera) -> None:
        import rerun

        pose = rerun.Transform3D(
            mat3x3=rotation_matrix(camera).T, translation=camera_center(camera)
        )
        pinhole = rerun.Pinhole(
            resolution=[camera.width, camera.height],
            focal_length=[camera.fx, camera.fy],
            principal_point=[camera.cx, camera.cy],
            camera_xyz=rerun.ViewCoordinates.RDF,
        )
        path = f"world/cameras/{camera.name}"
        self._recording.log(path, pose, pinhole, static=True)
