"""Exports frames as a rerun recording (`.rrd`) with splats and cameras on a timeline.

Coordinates are those of the stream; the recording declares the up axis.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from quarc_ref.datasets.camera_geometry import camera_center, rotation_matrix
from quarc_ref.export.activate import base_colors_of, opacities_of, scales_of, xyzw_of
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.format.cameras import Camera

_REST_COEFFICIENTS = 15  # coefficients of degrees 1 to 3, all of which rerun requires


class Sequence:
    """Collects all frames in one recording.

    Args:
        clip: Properties of all frames.
    """

    def __init__(self, clip: Clip) -> None:
        import rerun

        self._clip = clip
        self._folder = TemporaryDirectory()
        self._path = Path(self._folder.name) / "frames.rrd"
        self._recording = recording = rerun.RecordingStream("quarc-ref")
        recording.save(self._path)
        hand = "RIGHT" if clip.header.right_handed else "LEFT"
        up = f"{hand}_HAND_{clip.up[1].upper()}_{'UP' if clip.up[0] == '+' else 'DOWN'}"
        recording.log("world", getattr(rerun.ViewCoordinates, up), static=True)
        for camera in clip.cameras:
            self._add_camera(camera)

    def add(self, frame: Frame) -> None:
        """Append a frame."""
        import rerun

        splats, recording = frame.splats, self._recording
        recording.set_time("frame", sequence=frame.scene.frame)
        recording.set_time("time", duration=self._clip.seconds(frame.scene.frame))
        colors = np.concatenate([base_colors_of(splats), opacities_of(splats)[:, None]], axis=1)
        rest = np.zeros((len(colors), _REST_COEFFICIENTS, 3), dtype=np.float32)
        rest[:, : splats.sh.shape[1] - 1] = splats.sh[:, 1:]
        has_rest = splats.sh.shape[1] > 1
        logged = rerun.GaussianSplats3D(
            splats.positions,
            scales=scales_of(splats),
            quaternions=xyzw_of(splats.rotations),
            colors=np.round(colors * 255).astype(np.uint8),
            sh_coefficients=rest if has_rest else None,
            spherical_harmonics_degree=1 if has_rest else 0,
        )
        recording.log("world/splats", logged)

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
        lens = rerun.Pinhole(
            resolution=[camera.width, camera.height],
            focal_length=[camera.fx, camera.fy],
            principal_point=[camera.cx, camera.cy],
            camera_xyz=rerun.ViewCoordinates.RDF,
        )
        path = f"world/cameras/{camera.name}"
        self._recording.log(path, pose, lens, static=True)
