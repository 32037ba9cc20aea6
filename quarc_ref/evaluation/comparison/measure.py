"""Measures all entries on the same frames and cameras."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from quarc_ref.datasets.capture import Alpha, Capture, Image
from quarc_ref.evaluation.camera_group import find_background, list_variants
from quarc_ref.evaluation.camera_meter import CameraMeter, Measures
from quarc_ref.evaluation.comparison.common_frames import choose_frames, describe_frames
from quarc_ref.evaluation.comparison.entries import Entry, EntryInfo, Label
from quarc_ref.evaluation.comparison.open_entries import ComparisonInputs
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.evaluation.metrics import Mask, Picture
from quarc_ref.evaluation.protocol import SharedProtocol, make_shared_protocol
from quarc_ref.evaluation.quality import Quality
from quarc_ref.evaluation.views import make_view_with_truth, select_pixels

_MAX_SHOWN_CAMERAS = 4  # cameras whose views the page shows


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredEntry:
    """An entry and its metrics.

    Attributes:
        label: Method and operating point of the entry.
        info: Frames and size of the entry.
        quality: Metrics of each camera, one `Measures` per compared frame.
    """

    label: Label
    info: EntryInfo
    quality: Quality


@dataclass(frozen=True, slots=True, eq=False)
class ComparedView:
    """The pictures of all entries for one camera and frame, for visual comparison.

    Attributes:
        camera: Name of the camera.
        frame: Ordinal of the frame.
        truth: `[H, W, 3]` ground truth from 0 to 1.
        pictures: `[H, W, 3]` pictures from 0 to 1, in the order of the entries.
        psnr: PSNR of each entry, in dB.
    """

    camera: str
    frame: int
    truth: Picture
    pictures: list[Picture]
    psnr: list[float]


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Measurements of all entries.

    Attributes:
        measured_entries: Measured entries, in the order of the command line.
        frames: Ordinals of the compared frames.
        cameras: Names of the compared cameras.
        truth_description: Human-readable description of the ground truth.
        frames_per_second: Frame rate of all entries.
        shown_views: Views that the page shows.
        variants: Description of each metric's exact variant, keyed by metric name.
        protocol: Conditions of the measurement.
        remarks: What limits the comparison, in sentences without a full stop: `doubts` of the
            inputs, and those of `describe_frames`.
    """

    measured_entries: list[MeasuredEntry]
    frames: tuple[int, ...]
    cameras: tuple[str, ...]
    truth_description: str
    frames_per_second: float
    shown_views: list[ComparedView]
    variants: dict[str, str]
    protocol: SharedProtocol
    remarks: tuple[str, ...] = ()


def measure_entries(
    inputs: ComparisonInputs,
    span: tuple[int, int | None],
    lpips: Lpips | None,
    on_progress: Callable[[str, int, int], None],
) -> Comparison:
    """Measure entries on their common frames.

    Args:
        inputs: The entries and the ground truth.
        span: First frame and end frame (exclusive); an end of None includes all later frames.
        lpips: LPIPS metric; None to omit it.
        on_progress: Called after every frame with the name of the stage, the number of measured
            frames and the total number of frames.

    Raises:
        BitstreamError: A stream is malformed.
        CaptureError: A picture cannot be read.
        UnreadableFramesError: A file of another method is malformed.
        EntryError: The entries have no common frame within the span, or a render does not have the
            size of its camera.
        MismatchError: The pictures of a camera are too small for LPIPS.
    """
    frames = choose_frames(inputs, span)
    entries = inputs.entries if inputs.capture else inputs.entries[1:]
    meter = _EntryMeter(inputs, entries, frames, lpips)
    for measured_count, frame in enumerate(frames, start=1):
        meter.measure(frame)
        on_progress("compare", measured_count, len(frames))
    if inputs.capture is None:
        truth_description = f"the renders of {inputs.entries[0].label}"
    else:
        truth_description = f"the pictures of {inputs.capture.name}"
    return Comparison(
        meter.list_results(), frames, tuple(inputs.cameras), truth_description,
        inputs.frames_per_second, meter.shown_views, meter.variants,
        make_shared_protocol(inputs.capture, next(iter(inputs.cameras.values()))),
        (*inputs.doubts, *describe_frames(inputs)),
    )  # fmt: skip


class _EntryMeter:
    """Measures the views of all entries, frame by frame."""

    def __init__(
        self,
        inputs: ComparisonInputs,
        entries: Sequence[Entry],
        frames: Sequence[int],
        lpips: Lpips | None,
    ) -> None:
        self._inputs, self._entries, self._lpips = inputs, entries, lpips
        capture, cameras = inputs.capture, inputs.cameras
        if lpips is not None:
            lpips.require_sizes(cameras.values())
        backgrounds = {name: _find_background(capture, name) for name in cameras}
        self._meters = [{name: CameraMeter(backgrounds[name]) for name in cameras} for _ in entries]
        self._metrics: list[dict[str, list[Measures]]] = [
            {name: [] for name in cameras} for _ in entries
        ]
        self._shown_camera_frames = _choose_shown_views(list(cameras), frames)
        self.shown_views: list[ComparedView] = []

    @property
    def variants(self) -> dict[str, str]:
        """Description of each metric's exact variant, keyed by metric name."""
        return list_variants(self._lpips)

    def measure(self, frame: int) -> None:
        """Render and measure a frame of every entry."""
        truths = dict(_load_truths(self._inputs, frame))
        renderings = [entry.render(frame, self._inputs.cameras) for entry in self._entries]
        for name in set(self._inputs.cameras) - set(truths):  # the capture ignores them
            for metrics_by_camera in self._metrics:
                metrics_by_camera[name].append({})
        for name, (image, truth, mask, alpha) in truths.items():
            views = [
                make_view_with_truth(
                    frame, name, image, truth, picture, select_pixels(picture, mask, alpha)
                )
                for picture in (pictures[name] for pictures in renderings)
            ]
            for meter_by_camera, metrics_by_camera, view in zip(
                self._meters, self._metrics, views, strict=True
            ):
                view_metrics = meter_by_camera[name].measure(view)
                if self._lpips is not None:
                    view_metrics["lpips"] = self._lpips.measure(view.decoded, view.truth)
                metrics_by_camera[name].append(view_metrics)
            if (name, frame) in self._shown_camera_frames:
                pictures = [view.decoded for view in views]
                psnr = [view.psnr for view in views]
                self.shown_views.append(ComparedView(name, frame, views[0].truth, pictures, psnr))

    def list_results(self) -> list[MeasuredEntry]:
        """Return the metrics of all frames measured so far."""
        return [
            MeasuredEntry(entry.label, entry.info, Quality(metrics))
            for entry, metrics in zip(self._entries, self._metrics, strict=True)
        ]


def _load_truths(
    inputs: ComparisonInputs, frame: int
) -> Iterator[tuple[str, tuple[Image, Picture, Mask | None, Alpha | None]]]:
    """Yield each used camera's name, and its truth in 8-bit levels and as floats, mask and alpha.

    The ground truth is the camera's picture or, without a capture, the rendering of the
    first entry.
    """
    capture = inputs.capture
    if capture is None:
        for name, picture in inputs.entries[0].render(frame, inputs.cameras).items():
            yield name, ((picture * 255).round().astype(np.uint8), picture, None, None)
        return
    for name in inputs.cameras:
        index = _find_index(capture, name)
        if not capture.is_used(index, frame):
            continue
        image = capture.image(index, frame)
        truth = image.astype(np.float32) / np.float32(255)
        yield name, (image, truth, capture.mask(index, frame), capture.alpha(index, frame))


def _find_index(capture: Capture, name: str) -> int:
    return [camera.name for camera in capture.cameras].index(name)


def _find_background(capture: Capture | None, name: str) -> Picture | None:
    """Return the static background of a camera; None if there is no capture."""
    return None if capture is None else find_background(capture, _find_index(capture, name))


def _choose_shown_views(cameras: Sequence[str], frames: Sequence[int]) -> set[tuple[str, int]]:
    """Return camera-frame pairs: three frames of the first camera, one of each of a few others."""
    middle_frame = frames[len(frames) // 2]
    first_camera_views = {(cameras[0], frame) for frame in (frames[0], middle_frame, frames[-1])}
    return first_camera_views | {(name, middle_frame) for name in cameras[1:_MAX_SHOWN_CAMERAS]}
