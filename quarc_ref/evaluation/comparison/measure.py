"""Measures all entries on the same frames and cameras."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from quarc_ref.datasets.capture import Capture, Image
from quarc_ref.evaluation.camera_group import find_background, name_variants
from quarc_ref.evaluation.camera_meter import CameraMeter, Measures
from quarc_ref.evaluation.comparison.entries import Entry, EntryError, EntryInfo, Label
from quarc_ref.evaluation.comparison.open_entries import OpenComparison
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.evaluation.metrics import Mask, Picture
from quarc_ref.evaluation.quality import Quality
from quarc_ref.evaluation.views import compare_pictures

_MAX_CAMERAS = 4  # number of views to show


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """An entry and its metrics.

    Attributes:
        label: Its method and operating point.
        info: Its frames and size.
        quality: Metrics: for each camera, one `Measures` per compared frame.
    """

    label: Label
    info: EntryInfo
    quality: Quality


@dataclass(frozen=True, slots=True, eq=False)
class ComparedView:
    """A view of all entries, for visual comparison.

    Attributes:
        camera: Name of the camera.
        frame: Ordinal of the frame.
        truth: `[H, W, 3]` ground truth from 0 to 1.
        pictures: `[H, W, 3]` pictures from 0 to 1, in the order of the entries.
        psnr: PSNR of each entry, dB.
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
        measured: Measurements of each entry, in the order of the entries.
        frames: Ordinals of the compared frames.
        cameras: Names of the compared cameras.
        truth: Human-readable description of the ground truth.
        frames_per_second: Frame rate of all entries.
        shown: Views to show.
        variants: The variant of each metric, by its name.
    """

    measured: list[Measured]
    frames: tuple[int, ...]
    cameras: tuple[str, ...]
    truth: str
    frames_per_second: float
    shown: list[ComparedView]
    variants: dict[str, str]


def measure_entries(
    opened: OpenComparison,
    span: tuple[int, int | None],
    lpips: Lpips | None,
    on_progress: Callable[[str, int, int], None],
) -> Comparison:
    """Measure entries on all frames that they have in common.

    Args:
        opened: The entries and the ground truth.
        span: First frame and the one after the last; None for all frames.
        lpips: LPIPS metric; None to omit it.
        on_progress: Called after every frame: stage, done, total.

    Raises:
        BitstreamError: A stream is malformed.
        CaptureError: A picture cannot be read, or a render and its camera differ in size.
        UnreadableFramesError: A file of another method is malformed.
        EntryError: There is no common frame.
    """
    frames = _choose_frames(opened, span)
    entries = opened.entries if opened.capture else opened.entries[1:]
    pairs = _Pairs(opened, entries, frames, lpips)
    for done, frame in enumerate(frames, start=1):
        pairs.measure(frame)
        on_progress("compare", done, len(frames))
    if opened.capture is None:
        truth = f"the renders of {opened.entries[0].label}"
    else:
        truth = f"the pictures of the capture {opened.capture.name}"
    return Comparison(
        pairs.results(), frames, tuple(opened.cameras), truth, opened.frames_per_second,
        pairs.shown, pairs.variants,
    )  # fmt: skip


class _Pairs:
    """Measures the views of all entries, frame by frame."""

    def __init__(
        self,
        opened: OpenComparison,
        entries: Sequence[Entry],
        frames: Sequence[int],
        lpips: Lpips | None,
    ) -> None:
        self._opened, self._entries, self._lpips = opened, entries, lpips
        capture, cameras = opened.capture, opened.cameras
        backgrounds = {name: _find_background(capture, name) for name in cameras}
        self._meters = [{name: CameraMeter(backgrounds[name]) for name in cameras} for _ in entries]
        self._figures: list[dict[str, list[Measures]]] = [
            {name: [] for name in cameras} for _ in entries
        ]
        self._wanted = _choose_shown(list(cameras), frames)
        self.shown: list[ComparedView] = []

    @property
    def variants(self) -> dict[str, str]:
        """The variant of each metric."""
        return name_variants(self._lpips)

    def measure(self, frame: int) -> None:
        """Render and measure a frame of every entry."""
        truths = dict(_draw_truth(self._opened, frame))
        drawn = [entry.draw(frame, self._opened.cameras) for entry in self._entries]
        for name, (image, truth, mask) in truths.items():
            views = [
                compare_pictures(frame, name, image, truth, pictures[name], mask)
                for pictures in drawn
            ]
            for meters, figures, view in zip(self._meters, self._figures, views, strict=True):
                found = meters[name].measure(view)
                if self._lpips is not None:
                    found["lpips"] = self._lpips.measure(view.decoded, view.truth)
                figures[name].append(found)
            if (name, frame) in self._wanted:
                pictures = [view.decoded for view in views]
                psnr = [view.psnr for view in views]
                self.shown.append(ComparedView(name, frame, truth, pictures, psnr))

    def results(self) -> list[Measured]:
        """Return the metrics of all frames so far."""
        return [
            Measured(entry.label, entry.info, Quality(figures))
            for entry, figures in zip(self._entries, self._figures, strict=True)
        ]


def _draw_truth(
    opened: OpenComparison, frame: int
) -> Iterator[tuple[str, tuple[Image, Picture, Mask | None]]]:
    """Yield the ground truth of each camera as levels and from 0 to 1, and its mask.

    The ground truth is the camera's picture or, without a capture, the rendering of the
    first entry.
    """
    capture = opened.capture
    if capture is None:
        for name, picture in opened.entries[0].draw(frame, opened.cameras).items():
            yield name, ((picture * 255).round().astype(np.uint8), picture, None)
        return
    for name in opened.cameras:
        index = _find_index(capture, name)
        image = capture.image(index, frame)
        truth = image.astype(np.float32) / np.float32(255)
        yield name, (image, truth, capture.mask(index, frame))


def _find_index(capture: Capture, name: str) -> int:
    return [camera.name for camera in capture.cameras].index(name)


def _find_background(capture: Capture | None, name: str) -> Picture | None:
    """Return the static background of a camera; None if the ground truth is an entry."""
    return None if capture is None else find_background(capture, _find_index(capture, name))


def _choose_frames(opened: OpenComparison, span: tuple[int, int | None]) -> tuple[int, ...]:
    """Return the frames within a span that all entries and the capture have."""
    common = set.intersection(*(set(entry.info.frames) for entry in opened.entries))
    if opened.capture is not None:
        common &= set(range(opened.capture.frame_count))
    start, stop = span
    chosen = tuple(
        frame for frame in sorted(common) if start <= frame and (stop is None or frame < stop)
    )
    if not chosen:
        has = "; ".join(f"{entry.label}: {_name_span(entry)}" for entry in opened.entries)
        message = f"the entries have no frame in common ({has})"
        raise EntryError(message)
    return chosen


def _name_span(entry: Entry) -> str:
    frames = entry.info.frames
    return f"{frames[0]} to {frames[-1]}" if frames else "none"


def _choose_shown(cameras: Sequence[str], frames: Sequence[int]) -> set[tuple[str, int]]:
    """Return three frames of the first camera, and one of some others."""
    middle = frames[len(frames) // 2]
    first = {(cameras[0], frame) for frame in (frames[0], middle, frames[-1])}
    return first | {(name, middle) for name in cameras[1:_MAX_CAMERAS]}
