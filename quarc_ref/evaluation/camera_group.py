"""Cameras of a capture that are measured together, frame after frame."""

from collections.abc import Sequence

from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder import Splats
from quarc_ref.evaluation.camera_meter import CameraMeter, Measures
from quarc_ref.evaluation.color_correction import COLOR, Correction
from quarc_ref.evaluation.metrics import Picture
from quarc_ref.evaluation.quality import Quality
from quarc_ref.evaluation.regions import choose_frames, find_background
from quarc_ref.evaluation.views import View, measure_views
from quarc_ref.format.cameras import Camera


class CameraGroup:
    """Measures decoded frames on some cameras; frames are given in the order of time.

    Args:
        capture: Whose pictures are the truth.
        cameras: To draw with, in the order of the capture, as for `measure_views`.
        indices: Of the cameras in the group.
        correction: Of colors, for the figures that are named after it.

    Raises:
        CaptureError: A picture cannot be read.
    """

    def __init__(
        self,
        capture: Capture,
        cameras: Sequence[Camera],
        indices: Sequence[int],
        correction: Correction = COLOR,
    ) -> None:
        self._capture = capture
        self._cameras = cameras
        self._indices = indices
        self._meters = [
            CameraMeter(_find_background(capture, index), correction) for index in indices
        ]
        self._measured: dict[str, list[Measures]] = {cameras[index].name: [] for index in indices}

    @property
    def quality(self) -> Quality:
        """The figures of all frames so far."""
        return Quality(self._measured)

    def measure(self, splats: Splats, frame: int) -> list[View]:
        """Measure a frame on every camera of the group; return what they see.

        Args:
            splats: The frame's scene in floats.
            frame: Its ordinal.

        Raises:
            CaptureError: A picture cannot be read.
        """
        views = measure_views(splats, frame, self._cameras, self._capture, self._indices)
        for meter, view in zip(self._meters, views, strict=True):
            self._measured[view.camera].append(meter.measure(view))
        return views


def _find_background(capture: Capture, index: int) -> Picture | None:
    frames = choose_frames(capture.frame_count)
    return find_background([capture.image(index, frame) for frame in frames])
