"""Finds the frames that all entries of a comparison contain."""

from collections.abc import Collection, Iterator

from quarc_ref.datasets.capture import Capture
from quarc_ref.evaluation.comparison.entries import NUMBERED_KINDS, EntryError
from quarc_ref.evaluation.comparison.open_entries import ComparisonInputs


def choose_frames(inputs: ComparisonInputs, span: tuple[int, int | None]) -> tuple[int, ...]:
    """Return the frames within a span that exist in every entry and that the capture shows.

    Raises:
        EntryError: There are none.
    """
    common_frames = set.intersection(*(set(entry.info.frames) for entry in inputs.entries))
    if inputs.capture is not None:
        common_frames &= set(_list_shown_frames(inputs.capture, inputs.cameras))
    start, stop = span
    frames = tuple(
        frame
        for frame in sorted(common_frames)
        if start <= frame and (stop is None or frame < stop)
    )
    if not frames:
        message = (
            "the selected range has none of the frames that all entries have, "
            f"{format_frames(tuple(sorted(common_frames)))}"
            if common_frames
            else f"the entries have no frame in common ({_list_frames(inputs)})"
        )
        raise EntryError(message)
    return frames


def _list_shown_frames(capture: Capture, names: Collection[str]) -> Iterator[int]:
    """Yield the frames of a capture that at least one of the named cameras shows."""
    indices = [index for index, camera in enumerate(capture.cameras) if camera.name in names]
    for frame in range(capture.frame_count):
        if any(capture.is_used(index, frame) for index in indices):
            yield frame


def describe_frames(inputs: ComparisonInputs) -> list[str]:
    """Return remarks on frames that are not in all entries or not in the capture, and on numbers.

    Many methods number their files from 1. If the capture has one more frame than the entry, each
    of them would be measured against the next picture, without any other sign of the mistake.
    """
    remarks = []
    if len(_group_by_frames(inputs)) > 1:
        remark = "only frames in common are compared, but sizes include all frames of an entry"
        remarks.append(f"{remark}: {_list_frames(inputs)}")
    later_labels = dict.fromkeys(
        str(entry.label)
        for entry in inputs.entries
        if entry.info.kind in NUMBERED_KINDS and entry.info.frames[:1] == (1,)
    )
    remarks += [
        f"{label} has no frame 0, which is the first encoded frame: if its files are numbered from "
        "1, renumber them"
        for label in later_labels
    ]
    return remarks


def _list_frames(inputs: ComparisonInputs) -> str:
    """Return the ranges of frames, each with the entries that have it."""
    return "; ".join(
        f"{format_frames(frames)} in {', '.join(dict.fromkeys(owners))}"
        for frames, owners in _group_by_frames(inputs).items()
    )


def _group_by_frames(inputs: ComparisonInputs) -> dict[tuple[int, ...], list[str]]:
    """Return the labels of entries by their frames, and the capture if it lacks some of these."""
    owners_by_frames: dict[tuple[int, ...], list[str]] = {}
    for entry in inputs.entries:
        owners_by_frames.setdefault(entry.info.frames, []).append(str(entry.label))
    if inputs.capture is not None:
        frame_count = inputs.capture.frame_count
        if any(frames and frames[-1] >= frame_count for frames in owners_by_frames):
            owners_by_frames.setdefault(tuple(range(frame_count)), []).append("the capture")
    return owners_by_frames


def format_frames(frames: tuple[int, ...]) -> str:
    """Return the first and the last of some frames, and whether there are gaps between them."""
    if len(frames) < 2:
        return str(frames[0]) if frames else "none"
    has_gaps = frames[-1] - frames[0] >= len(frames)
    return f"{frames[0]} to {frames[-1]}{' with gaps' if has_gaps else ''}"
