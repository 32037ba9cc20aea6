"""Compares scenes with the pictures of a frame, on training views and on held-out cameras."""

from collections.abc import Sequence

from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.evaluation.camera_meter import CameraMeter, Measures
from quarc_ref.evaluation.color_correction import GAIN_CORRECTION
from quarc_ref.evaluation.quality import average
from quarc_ref.evaluation.regions import choose_background_frames, find_background
from quarc_ref.evaluation.views import measure_views
from quarc_ref.format.cameras import Camera

GROUP_NAMES = ("training", "held_out")
FIGURE_NAMES = ("gain_psnr", "moving_gain_psnr", "static_gain_psnr", "psnr", "gain_ssim")


class Judge:
    """Measures scenes after correcting the colors of each rendered picture by a gain per channel.

    Args:
        capture: Capture with the true pictures.
        cameras: Cameras for rendering, in the order of the capture.

    Raises:
        CaptureError: A picture cannot be read.
    """

    def __init__(self, capture: Capture, cameras: Sequence[Camera]) -> None:
        self._capture, self._cameras = capture, cameras
        self._groups = dict(zip(GROUP_NAMES, (capture.training, capture.held_out), strict=True))
        frames = choose_background_frames(capture.frame_count)
        self._backgrounds = {
            index: find_background([capture.image(index, frame) for frame in frames])
            for index in (*capture.training, *capture.held_out)
        }

    def measure(self, splats: Splats, frame: int) -> dict[str, Measures]:
        """Return the figures of a scene, averaged over the cameras of each group.

        Raises:
            CaptureError: A picture cannot be read.
        """
        return {name: self._measure_group(name, splats, frame) for name in self._groups}

    def _measure_group(self, group: str, splats: Splats, frame: int) -> Measures:
        indices = self._groups[group]
        views = measure_views(splats, frame, self._cameras, self._capture, indices)
        measured = [
            CameraMeter(self._backgrounds[index], GAIN_CORRECTION).measure(view)
            for index, view in zip(indices, views, strict=True)
        ]
        mean = average(measured)
        return {name: mean[name] for name in FIGURE_NAMES}
