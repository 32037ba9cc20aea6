"""Encodes a capture in segments, on one machine or many, and joins them.

Every segment starts with its own canonical frame, so segments are independent.
"""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO

from quarc_ref.datasets.capture import Capture, Image, Mask
from quarc_ref.datasets.findings import Finding, FindingCallback, ignore_finding
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder.description import describe_encode
from quarc_ref.encoder.encode_options import EncodeOptions
from quarc_ref.encoder.monitoring.monitor import NullMonitor
from quarc_ref.encoder.progress import NullProgress, Progress
from quarc_ref.encoder.resume.partial_stream import (
    read_partial_stream,
    require_count,
    require_match,
)
from quarc_ref.encoder.stream_file import encode_file
from quarc_ref.format.errors import ResumeError
from quarc_ref.jobs import Job, WorkerPool, run_jobs
from quarc_ref.streams.join import join
from quarc_ref.streams.sources import FileSource


@dataclass(frozen=True, slots=True)
class Segment:
    """Consecutive frames of a capture, with everything that a machine needs to encode them.

    Attributes:
        folder: Folder of the capture.
        opening: Options for opening it.
        options: Options of the encode; all frames of the segment are encoded.
        first: First frame of the segment.
        count: Number of frames.
        file: File of its stream; an existing partial stream in it is resumed.
    """

    folder: Path
    opening: CaptureOptions
    options: EncodeOptions
    first: int
    count: int
    file: Path

    @property
    def name(self) -> str:
        """Name in messages."""
        return f"frames {self.first} to {self.first + self.count - 1}"


def split_frames(frame_count: int, segment_count: int) -> list[tuple[int, int]]:
    """Return first frame and number of frames of each segment, as even as possible.

    Raises:
        ValueError: There are more segments than frames.
    """
    if not 1 <= segment_count <= frame_count:
        message = f"{frame_count} frames cannot be split into {segment_count} segments"
        raise ValueError(message)
    borders = [place * frame_count // segment_count for place in range(segment_count + 1)]
    return [(first, last - first) for first, last in pairwise(borders)]


def encode_segments(
    segments: Sequence[Segment],
    pool: WorkerPool,
    progress: Progress,
    report: FindingCallback = ignore_finding,
) -> None:
    """Encode segments, several at a time, without checking the capture for each.

    Args:
        segments: Segments with distinct files on storage that all machines share.
        pool: Processes or Ray cluster that encode them.
        progress: Called after every finished segment.
        report: Called with the findings of all segments at the end.

    Raises:
        JobsError: Some segments could not be encoded; the others are complete.
    """
    jobs = [
        Job(segment.name, replace(segment, options=_without_callbacks(segment.options)))
        for segment in segments
    ]
    found = run_jobs(
        encode_segment, jobs, pool, lambda _, *done: progress.advance("segments", *done)
    )
    for segment, findings in zip(segments, found, strict=True):
        for finding in findings:
            report(replace(finding, message=f"{segment.name}: {finding.message}"))


def _without_callbacks(options: EncodeOptions) -> EncodeOptions:
    """Return options without callbacks, which can be sent to another process."""
    return replace(
        options, progress=NullProgress(), checks=False, report=ignore_finding, monitor=NullMonitor()
    )


def encode_segment(segment: Segment) -> list[Finding]:
    """Encode a segment to its file; return the findings."""
    findings: list[Finding] = []
    capture = slice_capture(
        open_capture(segment.folder, segment.opening), segment.first, segment.count
    )
    options = replace(segment.options, frames=None, report=findings.append)
    encode_file(capture, segment.file, options)
    return findings


def join_segments(segments: Sequence[Segment], sink: BinaryIO) -> None:
    """Join the streams of segments."""
    with ExitStack() as files:
        join([FileSource(files.enter_context(each.file.open("rb"))) for each in segments], sink)


def require_finished(path: Path, capture: Capture, options: EncodeOptions) -> None:
    """Raise ResumeError unless a file is the complete stream of this encode."""
    with path.open("rb") as file:
        existing = read_partial_stream(FileSource(file))
    if existing is None or not existing.is_finished:
        message = f"{path} is not a complete stream; the joined segments would replace it"
        raise ResumeError(message)
    metadata = describe_encode(capture, options.config, options.device)
    require_match(existing, existing.header, capture.cameras, metadata)
    require_count(existing, capture.require_frames(options.frames))


def slice_capture(capture: Capture, first: int, count: int) -> Capture:
    """Return a capture with a range of frames of another one."""
    return Capture(
        name=capture.name,
        cameras=capture.cameras,
        frame_count=count,
        frames_per_second=capture.frames_per_second,
        points=capture.points,
        source=_LaterFrames(capture, first),
        fingerprint=capture.fingerprint,
        cache_bytes=0,  # the underlying capture has a cache
        full_capture=capture.full_capture,
        start=capture.start,
        notes=capture.notes,
        masks=_LaterMasks(capture, first) if capture.masks else None,
    )


class _LaterFrames:
    """Pictures of a capture, starting at a frame."""

    def __init__(self, capture: Capture, first: int) -> None:
        self._capture = capture
        self._first = first

    def read(self, camera: int, frame: int) -> Image:
        """See `PictureSource.read`."""
        return self._capture.image(camera, self._first + frame)


class _LaterMasks:
    """Masks of a capture, starting at a frame."""

    def __init__(self, capture: Capture, first: int) -> None:
        self._capture = capture
        self._first = first

    def read(self, camera: int, frame: int) -> Mask | None:
        """See `MaskSource.read`."""
        return self._capture.mask(camera, self._first + frame)
