"""Encodes a capture in segments, on one or several machines, and joins the streams.

Every segment starts with a canonical frame, so segments are independent.
"""

from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO, Generic, TypeVar

from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.findings import Finding, FindingCallback, ignore_finding
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder.checks.pose_checks import MIN_TRAINING_CAMERAS
from quarc_ref.encoder.description import describe_encode
from quarc_ref.encoder.encode_options import EncodeOptions
from quarc_ref.encoder.monitoring.monitor import NullMonitor
from quarc_ref.encoder.progress import NullProgress, Progress
from quarc_ref.encoder.resume.checkpoint import checkpoint_path
from quarc_ref.encoder.resume.differences import name_stream
from quarc_ref.encoder.resume.partial_stream import (
    read_partial_stream,
    require_frame_count,
    require_match,
)
from quarc_ref.encoder.stream_file import encode_file
from quarc_ref.format.errors import BitstreamError, ResumeError, UnusableCaptureError
from quarc_ref.jobs import Job, WorkerPool, run_jobs
from quarc_ref.streams.join import join
from quarc_ref.streams.sources import FileSource
from quarc_ref.wording import format_count

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Segment:
    """Consecutive frames of a capture, with everything that a machine needs to encode them.

    Attributes:
        folder: Folder of the capture.
        capture_options: Options of `open_capture`.
        options: Options of the encode; `frames` is ignored.
        first: First frame of the segment.
        count: Number of frames in the segment.
        file: File for the stream of the segment. If the file contains a partial stream, the
            encode continues that stream.
    """

    folder: Path
    capture_options: CaptureOptions
    options: EncodeOptions
    first: int
    count: int
    file: Path

    @property
    def name(self) -> str:
        """Frames of the capture, as messages name them, such as `frames 30 to 59`."""
        first = self.capture_options.start + self.first
        return f"frames {first} to {first + self.count - 1}"


def split_frames(frame_count: int, segment_count: int) -> list[tuple[int, int]]:
    """Return `(first frame, number of frames)` of each segment; lengths differ by at most 1.

    Raises:
        ValueError: There are more segments than frames.
    """
    if not 1 <= segment_count <= frame_count:
        message = (
            f"{format_count(frame_count, 'frame')} cannot be split into {segment_count} segments"
        )
        raise ValueError(message)
    boundaries = [index * frame_count // segment_count for index in range(segment_count + 1)]
    return [(first, last - first) for first, last in pairwise(boundaries)]


def encode_segments(
    segments: Sequence[Segment],
    pool: WorkerPool,
    progress: Progress,
    report: FindingCallback = ignore_finding,
) -> None:
    """Encode segments in parallel, without checking the capture again for each segment.

    Args:
        segments: Segments with distinct files on storage that all machines share.
        pool: Worker processes or Ray cluster that encode the segments.
        progress: Called after every finished segment.
        report: Called with every finding about a segment, after all segments are encoded.

    Raises:
        JobsError: Some segments could not be encoded; the others are complete.
    """
    jobs = [
        Job(segment.name, replace(segment, options=_without_callbacks(segment.options)))
        for segment in segments
    ]
    findings_by_segment = run_jobs(
        encode_segment, jobs, pool, lambda _, *done: progress.advance("segments", *done)
    )
    for segment, findings in zip(segments, findings_by_segment, strict=True):
        for finding in findings:
            report(replace(finding, message=f"{segment.name}: {finding.message}"))


def _without_callbacks(options: EncodeOptions) -> EncodeOptions:
    """Return options that can be sent to another process: without checks and callbacks."""
    return replace(
        options, progress=NullProgress(), checks=False, report=ignore_finding, monitor=NullMonitor()
    )


def encode_segment(segment: Segment) -> list[Finding]:
    """Encode a segment to its file; return the findings about its first frame.

    Raises:
        UnusableCaptureError: Only one training camera is used in the segment's first frame.
    """
    findings: list[Finding] = []
    capture = slice_capture(
        open_capture(segment.folder, segment.capture_options), segment.first, segment.count
    )
    if len(capture.training_at(0)) < MIN_TRAINING_CAMERAS:
        message = (
            f"frame {capture.start} begins a segment, but ignored_frames leaves only one training "
            "camera there: use another number of segments"
        )
        raise UnusableCaptureError(message)
    options = replace(segment.options, frames=None, report=findings.append)
    encode_file(capture, segment.file, options)
    return findings


def join_segments(segments: Sequence[Segment], sink: BinaryIO) -> None:
    """Join the streams of consecutive segments into one stream."""
    with ExitStack() as files:
        join(
            [FileSource(files.enter_context(segment.file.open("rb"))) for segment in segments], sink
        )


def require_same_split(segments: Sequence[Segment], folder: Path) -> None:
    """Raise ResumeError if a folder has parts of segments, but none of these segments."""
    found_names = {path.name for path in folder.glob("frames_*.quarc*") if path.stat().st_size}
    reusable_names = {
        name
        for segment in segments
        for name in (segment.file.name, checkpoint_path(segment.file).name)
    }
    if found_names and found_names.isdisjoint(reusable_names):
        message = (
            f"{folder} has segments of other frames, such as {min(found_names)}: use the same "
            "--segments and --frames as before, or --force without --resume to start again"
        )
        raise ResumeError(message)


def require_resumable(segments: Sequence[Segment], capture: Capture) -> None:
    """Raise ResumeError if the file of a segment contains a stream of another encode.

    Damaged files are left to `encode_segment`. Do not call this if other machines encode the
    segments, because they may have other versions of the libraries.
    """
    for segment in segments:
        if not segment.file.is_file():
            continue
        part = slice_capture(capture, segment.first, segment.count)
        metadata = describe_encode(part, segment.options.config, segment.options.device)
        with (
            segment.file.open("rb") as file,
            suppress(BitstreamError),
            name_stream(segment.file),
        ):
            partial_stream = read_partial_stream(FileSource(file))
            if partial_stream is not None:
                require_match(partial_stream, partial_stream.header, capture.cameras, metadata)


def require_finished(
    path: Path, capture: Capture, options: EncodeOptions, segments: Sequence[Segment]
) -> None:
    """Raise ResumeError unless a file contains the complete stream of these segments, joined."""
    with path.open("rb") as file:
        partial_stream = read_partial_stream(FileSource(file))
    if partial_stream is None or not partial_stream.is_finished:
        message = (
            f"{path} is not a complete stream, and the joined segments would replace it: delete "
            "the file, or choose another one"
        )
        raise ResumeError(message)
    metadata = describe_encode(capture, options.config, options.device)
    with name_stream(path):
        require_match(partial_stream, partial_stream.header, capture.cameras, metadata)
        require_frame_count(partial_stream, capture.require_frames(options.frames))
        frame_kind = options.config.canonical.frame_kind
        kinds = [frame_kind(frame) for segment in segments for frame in range(segment.count)]
        if [chunk.kind for chunk in partial_stream.frames] != kinds:
            message = (
                "the stream is complete, but was not encoded in these segments: use the same "
                "--segments as before, or encode to another file"
            )
            raise ResumeError(message)


def slice_capture(capture: Capture, first: int, count: int) -> Capture:
    """Return a capture with `count` frames of another capture, starting at frame `first`."""
    return Capture(
        name=capture.name,
        cameras=capture.cameras,
        frame_count=count,
        frames_per_second=capture.frames_per_second,
        points=capture.points,
        source=_LaterFrames(capture.image, first),
        fingerprint=capture.fingerprint,
        max_cache_bytes=0,  # the underlying capture has a cache
        full_capture=capture.full_capture,
        start=capture.start + first,
        notes=capture.notes,
        masks=_LaterFrames(capture.masks.read, first) if capture.masks else None,
        alphas=_LaterFrames(capture.alphas.read, first) if capture.alphas else None,
    )


class _LaterFrames(Generic[T]):
    """Source of pictures, masks or alpha whose frame 0 is frame `first` of a capture."""

    def __init__(self, read: Callable[[int, int], T], first: int) -> None:
        self._read = read
        self._first = first

    def read(self, camera: int, frame: int) -> T:
        """See `PictureSource.read`, `MaskSource.read` and `AlphaSource.read`."""
        return self._read(camera, self._first + frame)
