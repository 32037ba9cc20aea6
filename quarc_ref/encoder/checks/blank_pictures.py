"""Finds pictures that show nothing: black frames at the beginning of a video, or a covered lens.

Such a frame says nothing about poses, sharpness, exposure and motion. If more than half of the
cameras show nothing at the same time, the light is off.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.capture import Image
from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.datasets.ignored_frames import FrameSpan, join_frames, suggest_ignoring
from quarc_ref.encoder.checks.equal_pictures import is_blank, make_thumbnail
from quarc_ref.encoder.checks.projected_points import ProjectedPoints
from quarc_ref.encoder.checks.recording import GrayFrames, Recording

COVERED = "camera-covered"
TRIM_REMEDY = "cut the same time off the beginning of all videos (ffmpeg -i OLD.mp4 -ss 1 NEW.mp4)"

Flags = NDArray[np.bool_]


def are_blank(pictures: Iterable[Image]) -> Flags:
    """Return `[camera]` whether the picture of a camera shows nothing."""
    grays = (picture.astype(np.float32).mean(axis=2) for picture in pictures)
    return np.array([is_blank(make_thumbnail(gray)) for gray in grays], dtype=bool)


def are_lights_off(blank: Flags) -> Flags:
    """Return whether more than half of the cameras, the first axis, show nothing."""
    lights_off: Flags = 2 * blank.sum(axis=0) > len(blank)
    return lights_off


def find_blank_first_pictures(projected: ProjectedPoints) -> Iterator[Finding]:
    """Yield findings about cameras that show nothing in frame 0."""
    blank_names = projected.name_cameras(np.flatnonzero(projected.is_blank))
    if are_lights_off(projected.is_blank):
        message = (
            f"the pictures of {format_names(blank_names)} show nothing in frame 0, on which all "
            f"later frames depend: {TRIM_REMEDY}"
        )
        yield Finding("blank-first-frame", message, blank_names)
    else:
        yield from (_report_covered(name, [(0, 0)]) for name in blank_names)


def find_blank_frames(
    names: Sequence[str], recordings: Sequence[Recording], start: int = 0
) -> Iterator[Finding]:
    """Yield a finding for each camera that shows nothing in some of the first frames.

    Args:
        names: Names of the cameras.
        recordings: Recording of each camera.
        start: Frame of the synchronized recording that is frame 0 of the recordings.
    """
    blank = np.stack([_find_blank(recording.first_frames) for recording in recordings])
    blank &= ~are_lights_off(blank)
    for name, recording, is_covered in zip(names, recordings, blank, strict=True):
        frames = [start + frame for frame in recording.first_frames.frames[is_covered].tolist()]
        if is_covered.all() and _find_blank(recording.samples).all():
            yield _report_covered(name, [(frames[0], None)])
        elif frames:
            yield _report_covered(name, join_frames(frames))


def ignore_blank_frames(recording: Recording) -> Recording:
    """Return the recording without the frames that show nothing."""
    first_frames, samples = (
        replace(stored, is_usable=stored.is_usable & ~_find_blank(stored))
        for stored in (recording.first_frames, recording.samples)
    )
    return replace(recording, first_frames=first_frames, samples=samples)


def _find_blank(stored: GrayFrames) -> Flags:
    levels = stored.levels
    blank = np.array([is_blank(make_thumbnail(picture)) for picture in levels], dtype=bool)
    return blank & stored.is_usable


def _report_covered(name: str, spans: Sequence[FrameSpan]) -> Finding:
    frames = format_names([_describe_span(*span) for span in spans])
    message = (
        f"{name} shows nothing in {frames}, so it was covered or not recording yet: "
        f"{suggest_ignoring(name, spans)}"
    )
    return Finding(COVERED, message, (name,))


def _describe_span(first: int, last: int | None) -> str:
    if last is None:
        return f"frame {first} and all later ones"
    return f"frame {first}" if first == last else f"frames {first} to {last}"
