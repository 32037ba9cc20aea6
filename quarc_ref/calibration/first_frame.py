"""Computes scene points from frame 0, and finds cameras whose pictures contradict them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from quarc_ref.calibration.recordings import Recordings
from quarc_ref.datasets.calibration import CalibratedCamera, make_camera
from quarc_ref.datasets.camera_geometry import project_points
from quarc_ref.datasets.capture import Image, Points
from quarc_ref.datasets.capture_notes import CaptureNotes
from quarc_ref.datasets.triangulation import triangulate
from quarc_ref.datasets.undistortion import Rectifier
from quarc_ref.encoder.checks.color_agreement import compare_colors

_MIN_CAMERAS = 3  # the minimum for points, which are computed without the first camera
_NEAR = 1e-6  # any value above 0, because nothing is rendered


@dataclass(frozen=True, slots=True, eq=False)
class FirstFrame:
    """Cameras and their pictures of frame 0.

    Attributes:
        cameras: Pinholes.
        pictures: `[H, W, 3]` sRGB, one per camera.
    """

    cameras: tuple[CalibratedCamera, ...]
    pictures: tuple[Image, ...]

    def find_points(self) -> Points:
        """Return points of the scene, without the first camera, which encoding holds out."""
        first = 1 if len(self.cameras) > _MIN_CAMERAS else 0
        return triangulate(self.cameras[first:], list(self.pictures[first:]))

    def find_mismatches(self, points: Points) -> list[str]:
        """Return the names of cameras whose pictures do not show the points where they should be.

        Args:
            points: Points of the scene.
        """
        cameras = [
            make_camera(replace(camera, near=_NEAR), points.positions) for camera in self.cameras
        ]
        views = [project_points(camera, points.positions) for camera in cameras]
        found = compare_colors(cameras, views, points.colors, iter(self.pictures))
        blind = [index for index, view in enumerate(views) if not view.is_visible.any()]
        wrong = {*blind, *found.wrong_cameras, *(picture for picture, _ in found.mixed_up_pairs)}
        return [self.cameras[index].name for index in sorted(wrong)]


def read_first_frame(
    cameras: Sequence[CalibratedCamera], recordings: Recordings, frames: dict[str, float]
) -> FirstFrame:
    """Return the undistorted pictures of cameras at frame 0.

    Args:
        cameras: Calibrated cameras.
        recordings: Recordings that include those of the cameras.
        frames: Offsets of all cameras, in frames.

    Raises:
        CaptureError: A picture cannot be read.
    """
    firsts = CaptureNotes(frames).first_frames(recordings.names)
    rectifiers = [Rectifier(camera.lens) for camera in cameras]
    pinholes = [
        replace(camera, lens=rectifier.lens)
        for camera, rectifier in zip(cameras, rectifiers, strict=True)
    ]
    pictures = [
        rectifier.rectify(
            recordings.pictures.read(recordings.index(camera.name), firsts[camera.name])
        )
        for camera, rectifier in zip(cameras, rectifiers, strict=True)
    ]
    return FirstFrame(tuple(pinholes), tuple(pictures))
