"""Measures a stream: its size by kind, and its quality on the held-out cameras."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

import numpy as np

from kept_files import write_atomically
from quarc_ref.cli.output import TerminalProgress
from quarc_ref.decoder import Splats
from quarc_ref.evaluation.evaluate import evaluate_stream
from quarc_ref.evaluation.metrics import measure_psnr
from quarc_ref.evaluation.same_capture import open_same_capture
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import StreamSummary
from quarc_ref.rendering.pictures import render_picture
from rate.jobs import Job, encode_if_missing, list_differences
from studies import write_status


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """A stream and its measurements.

    Attributes:
        job: Requested stream.
        data: The stream.
        summary: Its frames and sizes.
        psnr: PSNR of held-out cameras for each frame, dB.
        differences: Settings in which it differs from the job: it existed before they were changed.
    """

    job: Job
    data: bytes
    summary: StreamSummary
    psnr: tuple[float, ...]
    differences: tuple[str, ...]


def measure(job: Job, folder: Path) -> Measured:
    """Return a measured stream; existing files are reused.

    Raises:
        MismatchError: The existing stream of that name is of another capture.
    """
    data = encode_if_missing(job, folder)
    summary = inspect_stream(data)
    differences = tuple(list_differences(job, summary.metadata))
    if differences:
        write_status(f"{job.file_name()} was made with other {', '.join(differences)}")
    psnr = _load_or_measure_psnr(job, data, folder / f"{job.file_name()}.psnr.json")
    return Measured(job, data, summary, psnr, differences)


def measure_first_frame(splats: Splats, measured: Measured) -> float:
    """Return the mean PSNR of a scene on the held-out pictures of frame 0, dB."""
    capture = open_same_capture(measured.summary, measured.job.capture)
    first = measured.summary.frames[0].frame
    numbers = []
    for index in capture.held_out:
        picture = np.clip(render_picture(splats, measured.summary.cameras[index]), 0, 1)
        truth = capture.image(index, first).astype(np.float32) / np.float32(255)
        numbers.append(measure_psnr(picture, truth))
    return fmean(numbers)


def _load_or_measure_psnr(job: Job, data: bytes, path: Path) -> tuple[float, ...]:
    """Return the quality of the given bytes, from a file if it was measured before."""
    digest = hashlib.sha256(data).hexdigest()
    if path.is_file() and (known := json.loads(path.read_text()))["sha256"] == digest:
        return tuple(known["psnr"])
    with TerminalProgress(quiet=False) as progress:
        psnr = evaluate_stream(data, job.capture, progress.advance).quality.psnr
    write_atomically(path, json.dumps({"sha256": digest, "psnr": psnr}, indent=2).encode())
    return psnr
