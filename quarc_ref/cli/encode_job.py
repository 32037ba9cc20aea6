"""Runs an encode: opens the capture, and writes the stream to a pipe or a file."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from quarc_ref.cli.encode_warnings import Warnings
from quarc_ref.cli.encoder_options import open_requested_capture, require_device
from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.stream_targets import growing_stream, kept_segments
from quarc_ref.cli.targets import written_file, written_stream

if TYPE_CHECKING:
    from quarc_ref.datasets.capture import Capture
    from quarc_ref.datasets.open_capture import CaptureOptions
    from quarc_ref.encoder import EncodeOptions
    from quarc_ref.encoder.monitoring.monitor import Monitor
    from quarc_ref.encoder.progress import Progress
    from quarc_ref.encoder.segments import Segment
    from quarc_ref.encoder.settings.config import EncoderConfig
    from quarc_ref.jobs import WorkerPool


@dataclass(frozen=True, slots=True)
class EncodeJob:
    """A capture to encode, and the options of the encode.

    Attributes:
        folder: Folder of the capture.
        opening: Start frame, held-out cameras and downscaling of the capture.
        config: Settings of the encoder.
        frames: Number of frames to encode; None for all.
        device: Value of `--device`.
        progress: Callback for the progress of every step.
        warnings: Prints and collects findings about the capture.
        checks: Whether to check the capture before encoding.
        monitor: Receives every training step and every frame.
    """

    folder: Path
    opening: "CaptureOptions"
    config: "EncoderConfig"
    frames: int | None
    device: str
    progress: "Progress"
    warnings: Warnings
    checks: bool
    monitor: "Monitor"

    def open(self) -> "tuple[Capture, EncodeOptions]":
        """Open the capture, and return it with the options of the encode.

        Raises:
            UsageError: A requested camera or frame does not exist.
            CaptureError: The capture cannot be read.
        """
        from quarc_ref.datasets.errors import TooFewFramesError
        from quarc_ref.encoder import EncodeOptions

        require_device(self.device)
        capture = open_requested_capture(self.folder, self.opening)
        try:
            capture.require_frames(self.frames)
        except TooFewFramesError as error:
            message = f"--frames {self.frames}: {error}"
            raise UsageError(message) from error
        return capture, EncodeOptions(
            self.config,
            self.frames,
            self.device,
            self.progress,
            checks=self.checks,
            report=self.warnings.add,
            monitor=self.monitor,
        )


@dataclass(frozen=True, slots=True)
class WriteMode:
    """Options for writing the output file.

    Attributes:
        force: Whether to replace an existing file.
        live: Whether to write to the final path directly, without a temporary file.
        resume: Whether to resume an interrupted encode.
    """

    force: bool
    live: bool
    resume: bool


def encode_to_pipe(work: EncodeJob, target: Path) -> None:
    """Encode a capture to standard output."""
    with written_stream(target, force=False) as sink:
        from quarc_ref.encoder import encode

        capture, options = work.open()
        encode(capture, sink, options)


def encode_to_file(work: EncodeJob, target: Path, wanted: WriteMode) -> None:
    """Encode a capture to a file, or resume an interrupted encode.

    Raises:
        UsageError: The file exists and `wanted` does not allow replacing or resuming it.
    """
    with growing_stream(target, force=wanted.force, live=wanted.live, resume=wanted.resume) as (
        path,
        file,
    ):
        from quarc_ref.encoder.stream_file import encode_into

        capture, options = work.open()
        encode_into(capture, file, path, options)


def encode_to_joined_file(
    work: EncodeJob, target: Path, wanted: WriteMode, segment_count: int, pool: "WorkerPool"
) -> None:
    """Encode segments of a capture independently, and join the segments to a single file.

    Raises:
        UsageError: The file exists and `wanted` does not allow replacing it, or there are fewer
            frames than segments.
        UnusableCaptureError: The capture cannot be encoded with useful quality.
        ResumeError: The file to resume is from a different capture, or has different settings.
        JobsError: Some segments could not be encoded; all finished segments are kept.
    """
    is_there = wanted.resume and target.is_file() and not wanted.force
    with kept_segments(target, force=wanted.force or is_there, resume=wanted.resume) as folder:
        from quarc_ref.encoder import segments
        from quarc_ref.encoder.resume.checkpoint import checkpoint_path

        capture, options = work.open()
        if is_there:
            segments.require_finished(target, capture, options)
            return
        options.check(capture)
        parts = _cut(work, capture, options, (folder.path.absolute(), segment_count))
        for part in parts:
            folder.add(part.file.name)
            folder.add(checkpoint_path(part.file).name)
        segments.encode_segments(parts, pool, work.progress, work.warnings.add)
        with written_file(target, force=wanted.force, durable=True) as sink:
            segments.join_segments(parts, sink)


def choose_pool(
    segment_count: int, workers: int | None, ray: str | None, device: str
) -> "WorkerPool":
    """Return the worker pool that encodes segments.

    Processes on this machine share the CPU cores evenly. A task on a cluster has one core, and a
    GPU if the device is CUDA.
    """
    from quarc_ref.jobs import WorkerPool

    processors = os.cpu_count() or 1
    at_a_time = workers or min(segment_count, processors)
    threads = 1 if ray else max(1, processors // at_a_time)
    return WorkerPool(at_a_time, threads, ray, 1.0 if device == "cuda" else 0.0)


def _cut(
    work: EncodeJob, capture: "Capture", options: "EncodeOptions", into: tuple[Path, int]
) -> "list[Segment]":
    """Split a capture into segments, whose files are in the given folder."""
    from quarc_ref.encoder.segments import Segment, split_frames

    folder, segment_count = into
    try:
        spans = split_frames(capture.require_frames(work.frames), segment_count)
    except ValueError as error:
        message = f"--segments {segment_count}: {error}"
        raise UsageError(message) from error
    return [
        Segment(
            work.folder.absolute(), work.opening, options, first, count,
            folder / f"frames_{first:06}_{count:06}.quarc",
        )
        for first, count in spans
    ]  # fmt: skip
