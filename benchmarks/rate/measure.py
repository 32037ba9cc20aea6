"""Measures the size of a stream by kind, and its quality on the held-out cameras."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

from atomic_files import write_atomically
from quarc_ref.cli.output import TerminalProgress
from quarc_ref.decoder import Splats
from quarc_ref.evaluation.evaluate import evaluate_stream
from quarc_ref.evaluation.same_capture import open_same_capture
from quarc_ref.evaluation.views import measure_views
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import StreamSummary
from rate.jobs import Job, encode_if_missing, list_differences
from studies import write_status


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredStream:
    """A stream and its measurements.

    Attributes:
        job: Job of the stream.
        data: Bytes of the stream.
        summary: Frames and sizes of the stream.
        psnr: PSNR of each frame on the held-out cameras, in dB.
        differences: Names of settings whose values in the stream of an earlier run differ from the
            job.
    """

    job: Job
    data: bytes
    summary: StreamSummary
    psnr: tuple[float, ...]
    differences: tuple[str, ...]


def measure(job: Job, folder: Path) -> MeasuredStream:
    """Encode and measure a stream, reusing the files that already exist.

    Raises:
        MismatchError: The existing stream was encoded from a different capture.
    """
    data = encode_if_missing(job, folder)
    summary = inspect_stream(data)
    open_same_capture(summary, job.capture)  # rejects a different capture, even if PSNR is known
    differences = tuple(list_differences(job, summary.metadata))
    if differences:
        write_status(
            f"{job.file_name()} was encoded with different values of {', '.join(differences)}"
        )
    psnr = _load_or_measure_psnr(job, data, folder / f"{job.file_name()}.psnr.json")
    return MeasuredStream(job, data, summary, psnr, differences)


def measure_first_frame_psnr(splats: Splats, stream: MeasuredStream) -> float:
    """Return the mean PSNR of a scene on the held-out pictures of frame 0, in dB."""
    capture = open_same_capture(stream.summary, stream.job.capture)
    first_ordinal = stream.summary.frames[0].frame
    views = measure_views(splats, first_ordinal, stream.summary.cameras, capture)
    return fmean(view.psnr for view in views)


def _load_or_measure_psnr(job: Job, data: bytes, path: Path) -> tuple[float, ...]:
    """Return the PSNR of each frame of a stream; load the values if they were measured before."""
    digest = hashlib.sha256(data).hexdigest()
    if path.is_file() and (saved := json.loads(path.read_text()))["sha256"] == digest:
        return tuple(saved["psnr"])
    with TerminalProgress(quiet=False) as progress:
        psnr = evaluate_stream(data, job.capture, progress.advance).quality.psnr
    write_atomically(path, json.dumps({"sha256": digest, "psnr": psnr}, indent=2).encode())
    return psnr
