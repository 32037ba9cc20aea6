"""Computes scene points from frame 0, and finds cameras whose pictures contradict the points."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.recordings import Recordings
from quarc_ref.datasets.calibration import CalibratedCamera, make_camera
from quarc_ref.datasets.camera_geometry import project_points
from quarc_ref.datasets.capture import Image, Points
from quarc_ref.datasets.capture_notes import CaptureNotes
from quarc_ref.datasets.triangulation import triangulate
from quarc_ref.datasets.undistortion import Rectifier
from quarc_ref.encoder.checks.blank_pictures import TRIM_REMEDY, are_blank, are_lights_off
from quarc_ref.encoder.checks.color_agreement import compare_colors

# If there are more cameras than this, points are triangulated without the first camera.
_MIN_TRIANGULATION_CAMERAS = 3
_NEAR_PLANE = 1e-6  # arbitrary value above 0, because nothing is rendered


@dataclass(frozen=True, slots=True, eq=False)
class FirstFrame:
    """Cameras and pictures of frame 0.

    Attributes:
        cameras: Cameras with pinhole lenses.
        pictures: `[H, W, 3]` sRGB, one per camera.
    """

    cameras: tuple[CalibratedCamera, ...]
    pictures: tuple[Image, ...]

    def triangulate_points(self) -> Points:
        """Triangulate points without the first camera, because `encode` holds it out by default.

        Raises:
            CalibrationError: Most cameras show nothing in frame 0.
            CaptureError: Too few points are found.
        """
        if are_lights_off(are_blank(self.pictures)):
            message = (
                "most cameras show nothing in frame 0, the first that all cameras recorded, so no "
                f"scene points can be found there: {TRIM_REMEDY}"
            )
            raise CalibrationError(message)
        first_index = 1 if len(self.cameras) > _MIN_TRIANGULATION_CAMERAS else 0
        return triangulate(self.cameras[first_index:], list(self.pictures[first_index:]))

    def find_mismatched_cameras(self, points: Points) -> list[str]:
        """Return the names of cameras whose pictures do not match the projected points.

        Args:
            points: Points of the scene.
        """
        cameras = [
            make_camera(replace(camera, near=_NEAR_PLANE), points.positions)
            for camera in self.cameras
        ]
        projections = [project_points(camera, points.positions) for camera in cameras]
        agreement = compare_colors(cameras, projections, points.colors, iter(self.pictures))
        indices_without_points = [
            index for index, projection in enumerate(projections) if not projection.is_visible.any()
        ]
        mismatched_indices = {
            *indices_without_points,
            *agreement.wrong_cameras,
            *(index for index, _ in agreement.mixed_up_pairs),
        }
        return [self.cameras[index].name for index in sorted(mismatched_indices)]


def read_first_frame(
    cameras: Sequence[CalibratedCamera], recordings: Recordings, offsets: dict[str, float]
) -> FirstFrame:
    """Read frame 0 of each camera, and undistort it.

    Frame 0 is that of a capture of these cameras; recordings of other cameras may start later.

    Args:
        cameras: Calibrated cameras.
        recordings: Recordings that include all of these cameras.
        offsets: Time offset of each camera in frames, by camera name.

    Raises:
        CaptureError: A picture cannot be read.
    """
    names = [camera.name for camera in cameras]
    first_frames = CaptureNotes({name: offsets[name] for name in names}).first_frames(names)
    rectifiers = [Rectifier(camera.lens) for camera in cameras]
    pinholes = [
        replace(camera, lens=rectifier.lens)
        for camera, rectifier in zip(cameras, rectifiers, strict=True)
    ]
    pictures = [
        rectifier.rectify(
            recordings.pictures.read(recordings.index(camera.name), first_frames[camera.name])
        )
        for camera, rectifier in zip(cameras, rectifiers, strict=True)
    ]
    return FirstFrame(tuple(pinholes), tuple(pictures))
