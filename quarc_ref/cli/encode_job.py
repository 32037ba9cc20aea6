"""Runs an encode: opens the capture, and writes the stream to a pipe or a file."""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from quarc_ref.cli.encode_arguments import reject_conflicts
from quarc_ref.cli.encode_findings import FindingCollector
from quarc_ref.cli.encoder_options import name_capture_options, require_device
from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.stream_targets import (
    checked_stream_path,
    open_segments_folder,
    open_stream_file,
    remove_partial_stream,
)
from quarc_ref.cli.targets import open_output_file, open_output_stream

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
        capture_options: Start frame, held-out cameras and downscaling of the capture.
        config: Settings of the encoder.
        frame_count: Number of frames to encode; None for all.
        device: Value of `--device`.
        progress: Callback for the progress of every step.
        findings: Prints and collects findings about the capture.
        should_check: Whether to check the capture before encoding.
        monitor: Receives every training step on a training view, and every frame.
        is_remote: Whether other machines encode, whose devices may differ from those of this one.
    """

    folder: Path
    capture_options: "CaptureOptions"
    config: "EncoderConfig"
    frame_count: int | None
    device: str
    progress: "Progress"
    findings: FindingCollector
    should_check: bool
    monitor: "Monitor"
    is_remote: bool = False

    def open(self) -> "tuple[Capture, EncodeOptions]":
        """Open the capture, and return it with the options of the encode.

        Raises:
            UsageError: A requested camera or frame does not exist.
            CaptureError: The capture cannot be read.
            UnicodeEncodeError: The name of the capture or of a camera is not valid UTF-8.
        """
        from quarc_ref.datasets.open_capture import open_capture
        from quarc_ref.encoder import EncodeOptions

        if not self.is_remote:
            require_device(self.device)
        with name_capture_options(self.capture_options, self.frame_count):
            capture = open_capture(self.folder, self.capture_options)
            capture.require_frames(self.frame_count)
        for name in (capture.name, *(camera.name for camera in capture.cameras)):
            name.encode()  # raises UnicodeEncodeError now, rather than after training
        return capture, EncodeOptions(
            self.config,
            self.frame_count,
            self.device,
            self.progress,
            checks=self.should_check,
            report=self.findings.add,
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


def encode_to_pipe(job: EncodeJob, target: Path) -> None:
    """Encode a capture to standard output."""
    with open_output_stream(target, force=False) as sink:
        from quarc_ref.encoder import encode

        capture, options = job.open()
        encode(capture, sink, options)


def encode_to_file(job: EncodeJob, target: Path, write_mode: WriteMode) -> None:
    """Encode a capture to a file, or resume an interrupted encode.

    Raises:
        UsageError: The file exists and `write_mode` does not allow replacing or resuming it.
    """
    from quarc_ref.encoder.stream_file import encode_into

    modes = {"force": write_mode.force, "live": write_mode.live, "resume": write_mode.resume}
    with checked_stream_path(target, **modes):
        capture, options = job.open()
        if not write_mode.resume:  # a resumed encode checks only if it has no frames
            options.check(capture)
            options = replace(options, checks=False)
    with open_stream_file(target, **modes) as (path, file):
        encode_into(capture, file, path, options)


def encode_to_joined_file(
    job: EncodeJob, target: Path, write_mode: WriteMode, segment_count: int, pool: "WorkerPool"
) -> None:
    """Encode segments of a capture independently, and join them into a single file.

    Raises:
        UsageError: The file exists and `write_mode` does not allow replacing it, or there are fewer
            frames than segments.
        UnusableCaptureError: The capture cannot be encoded with useful quality.
        ResumeError: The interrupted encode used a different capture or different settings.
        JobsError: Some segments could not be encoded; all finished segments are kept.
        ImportError: The pool is a Ray cluster, but Ray is not installed.
    """
    from quarc_ref.jobs import require_ray

    if pool.ray is not None:
        require_ray()
    is_finished = write_mode.resume and target.is_file() and not write_mode.force
    with open_segments_folder(
        target, force=write_mode.force or is_finished, resume=write_mode.resume
    ) as folder:
        from quarc_ref.encoder import segments
        from quarc_ref.encoder.resume.checkpoint import checkpoint_path

        capture, options = job.open()
        segment_list = _split_capture(job, capture, options, folder.path.absolute(), segment_count)
        if is_finished:
            segments.require_finished(target, capture, options, segment_list)
            return
        if write_mode.resume:
            segments.require_same_split(segment_list, folder.path)
        options.check(capture)
        if write_mode.force and not write_mode.resume:
            remove_partial_stream(target)
        for segment in segment_list:
            folder.register(segment.file.name)
            folder.register(checkpoint_path(segment.file).name)
        if not is_remote_cluster(pool.ray):
            segments.require_resumable(segment_list, capture)
        segments.encode_segments(segment_list, pool, job.progress, job.findings.add)
        with open_output_file(target, force=write_mode.force, durable=True) as sink:
            segments.join_segments(segment_list, sink)


def is_remote_cluster(ray_address: str | None) -> bool:
    """Return whether a Ray address, or None, is that of a cluster with other machines."""
    from quarc_ref.jobs.job import LOCAL_CLUSTER

    return ray_address not in (None, LOCAL_CLUSTER)


def choose_pool(
    segment_count: int, requested_workers: int | None, ray_address: str | None, device: str
) -> "WorkerPool":
    """Return the worker pool that encodes segments.

    On this machine, the worker processes share the CPU cores evenly. On a cluster, each task gets
    one core, and a GPU if the device is CUDA.

    Raises:
        UsageError: A number of workers is requested for a cluster, which chooses it itself.
    """
    from quarc_ref.jobs import WorkerPool

    has_useless_workers = is_remote_cluster(ray_address) and requested_workers is not None
    reject_conflicts(f"--ray {ray_address}", {"--workers": has_useless_workers})

    cpu_count = os.cpu_count() or 1
    worker_count = requested_workers or min(segment_count, cpu_count)
    thread_count = 1 if ray_address else max(1, cpu_count // worker_count)
    return WorkerPool(worker_count, thread_count, ray_address, 1.0 if device == "cuda" else 0.0)


def _split_capture(
    job: EncodeJob,
    capture: "Capture",
    options: "EncodeOptions",
    folder: Path,
    segment_count: int,
) -> "list[Segment]":
    """Split a capture into segments, whose streams are written to the given folder."""
    from quarc_ref.encoder.segments import Segment, split_frames

    try:
        ranges = split_frames(capture.require_frames(job.frame_count), segment_count)
    except ValueError as error:
        message = f"--segments {segment_count}: {error}"
        raise UsageError(message) from error
    return [
        Segment(
            job.folder.absolute(), job.capture_options, options, first, count,
            folder / f"frames_{first:06}_{count:06}.quarc",
        )
        for first, count in ranges
    ]  # fmt: skip
