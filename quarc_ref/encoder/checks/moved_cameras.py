"""Finds cameras that were moved or covered during a recording.

Median pictures of successive windows of time are compared with that of the first window. They are
divided into cells: where the camera stands still, most cells with texture look the same all the
time, although people move in some of them. The pictures are those of `Recording`, which are up to
191 pixels wide.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.datasets.ignored_frames import FrameSpan, suggest_ignoring
from quarc_ref.encoder.checks.blank_pictures import COVERED
from quarc_ref.encoder.checks.picture_shift import CELL_PIXELS, Picture, ReferencePicture
from quarc_ref.encoder.checks.recording import GrayFrames, Recording

_SAMPLES_PER_WINDOW = 5
_MIN_WINDOWS, _MAX_WINDOWS = 2, 12
_MIN_CHANGED_WINDOWS = 2  # of at least four windows: a single one may be an error
_MIN_SHIFT_PIXELS = 0.5  # of full pictures
_MIN_SHIFT = 0.15  # of downscaled pictures
_MAX_COVERED_CONTRAST = 0.3  # relative to the first window
_MIN_LIT_CONTRAST = 0.6  # median of all cameras; below, the light is probably off

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class _Change:
    """A span of frames in which a camera is moved or covered.

    Attributes:
        frames: First and last frame; None for the end of the recording.
        pixels: Largest shift of the full picture, pixels; 0 if the camera is covered.
    """

    frames: FrameSpan
    pixels: float = 0.0


def find_moved_cameras(
    names: Sequence[str], recordings: Sequence[Recording], start: int = 0
) -> Iterator[Finding]:
    """Yield findings about cameras that were moved or covered.

    Args:
        names: Names of the cameras.
        recordings: Recording of each camera.
        start: Frame of the synchronized recording that is frame 0 of the recordings.
    """
    histories = {
        name: history
        for name, recording in zip(names, recordings, strict=True)
        if (history := _make_history(recording)) is not None
    }
    if not histories:
        return
    contrasts = np.stack([history.contrasts for history in histories.values()])
    is_lit = np.median(contrasts, axis=0) >= _MIN_LIT_CONTRAST
    moved: dict[str, list[_Change]] = {}
    for name, history in histories.items():
        is_covered = (history.contrasts < _MAX_COVERED_CONTRAST) & is_lit
        covered = list(history.list_covered(is_covered, start))
        if covered:
            yield _report_covered(name, covered)
        changes = list(history.list_moved(is_lit & ~is_covered, start))
        if changes:
            moved[name] = changes
    if 2 * len(moved) > len(names):
        yield _report_moving_rig(moved)
    else:
        yield from (_report_moved(name, changes) for name, changes in moved.items())


def _report_covered(name: str, changes: Sequence[_Change]) -> Finding:
    spans = [change.frames for change in changes]
    message = (
        f"{name} shows almost nothing {_describe_spans(spans)}, so it was probably covered, or "
        f"switched off: {suggest_ignoring(name, spans)}"
    )
    return Finding(COVERED, message, (name,))


def _report_moved(name: str, changes: Sequence[_Change]) -> Finding:
    spans = [change.frames for change in changes]
    message = (
        f"the picture of {name} is shifted by {max(change.pixels for change in changes):.1f} "
        f"pixels {_describe_spans(spans)}, so the camera was probably pushed, and its pose does "
        f"not fit there: {suggest_ignoring(name, spans)}"
    )
    return Finding("camera-moved", message, (name,))


def _report_moving_rig(moved: dict[str, list[_Change]]) -> Finding:
    largest = max(change.pixels for changes in moved.values() for change in changes)
    message = (
        f"the pictures of {format_names(list(moved))} shift over time, by up to {largest:.1f} "
        "pixels, but a camera has the same pose in all frames: use cameras that stand still"
    )
    return Finding("camera-moved", message, tuple(moved))


def _describe_spans(spans: Sequence[FrameSpan]) -> str:
    return " and ".join(
        f"from frame {first} on" if last is None else f"in frames {first} to {last}"
        for first, last in spans
    )


@dataclass(frozen=True, slots=True, eq=False)
class _History:
    """How the picture of a camera differs from that of the first window of time.

    Windows without a usable sample, as where frames are ignored, count as unchanged.

    Attributes:
        recording: The recording.
        windows: Samples of each window.
        reference: The picture of the first window that has a usable sample.
        shifts: `[W, 2]` shift to the right and down, in pixels of the downscaled picture.
        contrasts: `[W]` contrast, relative to the first window.
    """

    recording: Recording
    windows: list[NDArray[np.intp]]
    reference: ReferencePicture
    shifts: Floats
    contrasts: Floats

    def list_covered(self, is_covered: Flags, start: int) -> Iterator[_Change]:
        """Yield the spans of the windows in which the camera is covered."""

        def looks_covered(levels: Picture) -> bool:
            return self.reference.measure_contrast(levels) < _MAX_COVERED_CONTRAST

        for run in _list_runs(is_covered):
            yield _Change(self._find_span(run, looks_covered, start))

    def list_moved(self, is_visible: Flags, start: int) -> Iterator[_Change]:
        """Yield the spans of the windows in which the picture is shifted.

        Args:
            is_visible: `[W]` whether the camera is neither covered nor in the dark.
            start: See `find_moved_cameras`.
        """
        block_size, lengths = self.recording.block_size, np.hypot(*self.shifts.T)
        min_length = max(_MIN_SHIFT, _MIN_SHIFT_PIXELS / block_size)
        for first, end in _list_runs((lengths > min_length) & is_visible):
            looks_moved = partial(self.reference.is_shifted, shift=self.shifts[first])
            pixels = block_size * float(lengths[first:end].max())
            yield _Change(self._find_span((first, end), looks_moved, start), pixels)

    def _find_span(
        self, run: tuple[int, int], looks_changed: Callable[[Picture], bool], start: int
    ) -> FrameSpan:
        """Return the frames of a change, including all that may belong to it.

        Args:
            run: The first window of the change, and the one after its last.
            looks_changed: Function that returns whether a picture looks changed.
            start: See `find_moved_cameras`.
        """
        first, end = run
        samples = self._samples_around(first)
        begin = _find_step(np.array([looks_changed(levels) for levels in samples.levels]))
        first_frame = start + int(samples.frames[begin - 1] + 1 if begin else samples.frames[0])
        if end == len(self.windows):
            return first_frame, None
        samples = self._samples_around(end)
        step = _find_step(np.array([not looks_changed(levels) for levels in samples.levels]))
        is_over = step < len(samples.frames)
        return first_frame, start + int(samples.frames[step] - 1 if is_over else samples.frames[-1])

    def _samples_around(self, window: int) -> GrayFrames:
        """Return the usable samples of a window and of the one before."""
        indices = np.concatenate(self.windows[max(0, window - 1) : window + 1])
        samples = self.recording.samples
        return samples.rows(indices[samples.is_usable[indices]])


def _find_step(flags: Flags) -> int:
    """Return the index from which on most flags are true, and before which most are false."""
    true_counts = np.array([0, *np.cumsum(flags)])
    false_counts = np.arange(len(true_counts)) - true_counts
    return int(np.argmin(true_counts + false_counts[-1] - false_counts))


def _make_history(recording: Recording) -> _History | None:
    """Return the history of a camera; None if it has few samples, few rows or little texture."""
    samples = recording.samples
    sample_count = len(samples.frames)
    window_count = min(sample_count // _SAMPLES_PER_WINDOW, _MAX_WINDOWS)
    if window_count < _MIN_WINDOWS or min(samples.pictures.shape[1:]) < CELL_PIXELS:
        return None
    windows = np.array_split(np.arange(sample_count), window_count)
    usable_windows = [window[samples.is_usable[window]] for window in windows]
    pictures = {
        index: np.median(samples.rows(usable).levels, axis=0)
        for index, usable in enumerate(usable_windows)
        if usable.size
    }
    if not pictures:
        return None
    reference = ReferencePicture(pictures[min(pictures)])
    if not reference.has_texture:
        return None
    shifts, contrasts = np.zeros((window_count, 2)), np.ones(window_count)
    for index, picture in pictures.items():
        shifts[index] = reference.measure_shift(picture)
        contrasts[index] = reference.measure_contrast(picture)
    return _History(recording, windows, reference, shifts, contrasts)


def _list_runs(is_changed: Flags) -> Iterator[tuple[int, int]]:
    """Yield the first index and the end of each run of changed windows that is long enough."""
    min_length = _MIN_CHANGED_WINDOWS if len(is_changed) > 3 else 1
    edges = np.flatnonzero(np.diff(np.concatenate([[False], is_changed, [False]]).astype(int)))
    for first, end in edges.reshape(-1, 2).tolist():
        if end - first >= min_length:
            yield first, end
