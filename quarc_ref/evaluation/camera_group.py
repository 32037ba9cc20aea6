"""Measures the quality of decoded frames on a group of cameras, frame by frame."""

from collections.abc import Sequence

from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder import Splats
from quarc_ref.evaluation import regions
from quarc_ref.evaluation.camera_meter import VARIANTS, CameraMeter, Measures
from quarc_ref.evaluation.color_correction import COLOR_CORRECTION, Correction
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.evaluation.metrics import Picture
from quarc_ref.evaluation.quality import Quality
from quarc_ref.evaluation.views import View, measure_views
from quarc_ref.format.cameras import Camera


class CameraGroup:
    """Measures decoded frames on a group of cameras; frames must be measured in temporal order.

    Args:
        capture: Capture whose pictures are the ground truth.
        cameras: Cameras for which to render, in the order of the capture; see `measure_views`.
        indices: Indices, in `cameras`, of the cameras that form the group.
        correction: Color correction; the names of corrected metrics contain its prefix.
        lpips: LPIPS metric; None to omit it.

    Raises:
        CaptureError: A picture cannot be read.
        MismatchError: The pictures of a camera are too small for LPIPS.
    """

    def __init__(
        self,
        capture: Capture,
        cameras: Sequence[Camera],
        indices: Sequence[int],
        correction: Correction = COLOR_CORRECTION,
        lpips: Lpips | None = None,
    ) -> None:
        self._capture = capture
        self._cameras = cameras
        self._indices = indices
        self._lpips = lpips
        if lpips is not None:
            lpips.require_sizes(cameras[index] for index in indices)
        self._meters = [
            CameraMeter(find_background(capture, index), correction) for index in indices
        ]
        self._metrics_by_camera: dict[str, list[Measures]] = {
            cameras[index].name: [] for index in indices
        }

    @property
    def quality(self) -> Quality:
        """The metrics of all frames measured so far."""
        return Quality(self._metrics_by_camera, self.variants)

    @property
    def variants(self) -> dict[str, str]:
        """Description of each metric's exact variant, keyed by metric name."""
        return list_variants(self._lpips)

    def measure(self, splats: Splats, frame: int) -> list[View]:
        """Measure a frame on every camera of the group; return the rendered views.

        Cameras whose picture of the frame is not used (`Capture.is_used`) have no view and no
        metrics.

        Args:
            splats: Splats of the frame.
            frame: Ordinal of the frame.

        Raises:
            CaptureError: A picture cannot be read.
        """
        views: list[View] = []
        for meter, index in zip(self._meters, self._indices, strict=True):
            metrics: Measures = {}
            if self._capture.is_used(index, frame):
                views += measure_views(splats, frame, self._cameras, self._capture, [index])
                metrics = meter.measure(views[-1])
                if self._lpips is not None:
                    metrics["lpips"] = self._lpips.measure(views[-1].decoded, views[-1].truth)
            self._metrics_by_camera[self._cameras[index].name].append(metrics)
        return views


def list_variants(lpips: Lpips | None) -> dict[str, str]:
    """Return the description of each metric's variant, including LPIPS if it is measured."""
    return VARIANTS if lpips is None else VARIANTS | {"lpips": lpips.variant}


def find_background(capture: Capture, index: int) -> Picture | None:
    """Return the static background of a camera; see `regions.find_background`.

    Args:
        capture: Capture that the camera belongs to.
        index: Index of the camera.

    Raises:
        CaptureError: A picture cannot be read.
    """
    frames = regions.choose_background_frames(capture.frame_count)
    return regions.find_background(
        [capture.image(index, frame) for frame in frames if capture.is_used(index, frame)]
    )
