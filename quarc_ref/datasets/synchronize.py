"""Synchronizes the cameras of a capture: applies their time offsets and the requested start."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

from quarc_ref.datasets.agreement import (
    compare_color_matrices,
    compare_frame_rates,
    compare_lengths,
    compare_rotations,
    find_hdr_videos,
)
from quarc_ref.datasets.capture_notes import NOTES_NAME, CaptureNotes
from quarc_ref.datasets.errors import CountMismatchError, StartError
from quarc_ref.datasets.findings import FRAME_NUMBERS, STATED_FRAME_RATE, Finding, format_names
from quarc_ref.datasets.footage import Footage
from quarc_ref.datasets.ignored_frames import IgnoredFrames
from quarc_ref.datasets.lens_checks import find_odd_principal_points, find_stretched_pixels
from quarc_ref.datasets.pictures import SynchronizedPictures
from quarc_ref.wording import format_count


def synchronize(
    path: Path, footage: Footage, notes: CaptureNotes, start: int, max_frames: int | None
) -> tuple[Footage, SynchronizedPictures]:
    """Apply the cameras' time offsets, and drop the frames before the requested start.

    Args:
        path: Path of the capture.
        footage: Contents of the capture.
        notes: Notes of the capture, with the offsets.
        start: Frame of the synchronized recording that becomes frame 0.
        max_frames: Maximum number of frames from `start` on; None for all frames.

    Returns:
        The footage, with added findings about its recordings; and the synchronized pictures.

    Raises:
        CaptureError: The offset of an unknown camera is given, or `start` or an offset is
            after the last frame.
    """
    offsets = notes.first_frames([camera.name for camera in footage.cameras])
    ended = _list_ended(footage, offsets, notes.ignored_frames)
    pictures = SynchronizedPictures(footage.source, [start + n for n in offsets.values()], ended)
    common_count = pictures.frame_count
    lengths = {
        name: length
        for index, (name, length) in enumerate(zip(offsets, footage.source.lengths, strict=True))
        if index not in ended
    }
    if common_count < 1:
        _reject_start(path, lengths, offsets, start)
    used_count = min(common_count, max_frames or common_count)
    findings = (
        *(finding for finding in footage.findings if not _is_resolved(finding, notes, offsets)),
        *_compare_recordings(footage, offsets, start + used_count - 1),
    )
    if max_frames is None or max_frames > common_count:  # otherwise, all frames are available
        used_offsets = [offsets[name] for name in lengths]
        uneven = compare_lengths(list(lengths), list(lengths.values()), used_offsets)
        findings = (*findings, *filter(None, [uneven]))
    footage = replace(footage, findings=findings)
    if any(offsets.values()) or notes.has_transparent_background:
        description_files = (*footage.description_files, path / NOTES_NAME)
        footage = replace(footage, description_files=description_files)
    return footage, pictures


def _compare_recordings(
    footage: Footage, offsets: Mapping[str, int], last_frame: int
) -> Iterator[Finding]:
    """Yield findings about rotations, colors, lenses and frame rates.

    Args:
        footage: Contents of the capture.
        offsets: Offsets of all cameras, frames.
        last_frame: Last frame that is used.
    """
    names, source = list(offsets), footage.source
    findings = (
        compare_rotations(names, source.rotations),
        find_hdr_videos(names, source.hdr_flags),
        compare_color_matrices(names, source.color_matrices, source.hdr_flags),
        find_odd_principal_points(footage.cameras),
        find_stretched_pixels(footage.cameras, source.pixel_aspects),
        compare_frame_rates(names, source.frame_rates, last_frame),
    )
    yield from filter(None, findings)


def _list_ended(
    footage: Footage, offsets: Mapping[str, int], ignored: IgnoredFrames
) -> frozenset[int]:
    """Return the cameras that are not used after their last frame; none if all cameras are."""
    ended = frozenset(
        camera
        for camera, (name, offset) in enumerate(offsets.items())
        if ignored.contains_rest(name, footage.source.lengths[camera] - offset)
    )
    return ended if len(ended) < len(offsets) else frozenset()


def _is_resolved(finding: Finding, notes: CaptureNotes, offsets: Mapping[str, int]) -> bool:
    """Return whether the notes decide what a finding asks."""
    if finding.kind == STATED_FRAME_RATE:
        return notes.frames_per_second is not None
    return finding.kind == FRAME_NUMBERS and any(offsets.values())


def _reject_start(
    path: Path, lengths: Mapping[str, int], offsets: Mapping[str, int], start: int
) -> NoReturn:
    """Raise the error for a start or offsets after the last frame of a camera."""
    frame_counts = {name: length - offsets[name] for name, length in lengths.items()}
    if min(frame_counts.values()) >= 1:
        message = (
            f"cannot start at frame {start}: the capture has "
            f"{format_count(min(frame_counts.values()), 'frame')} common to all cameras"
        )
        raise StartError(message)
    skipped_names = [name for name, count in frame_counts.items() if count < 1]
    message = (
        f"the offsets in {path / NOTES_NAME} skip all frames of {format_names(skipped_names)}: "
        "correct the offsets, or remove the camera"
    )
    raise CountMismatchError(message)
