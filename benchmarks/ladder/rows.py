"""Makes rows: fits a rung to a frame, measures the result, and saves the row as a file."""

import hashlib
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ladder.fitting import fit_rung
from ladder.judging import Judge
from ladder.rounding import allow_updates, round_rung, to_splats
from ladder.rungs import STILL_NAME, Rung
from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder.reconstruct import begin_frame
from quarc_ref.decoder.state import State
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import list_settings
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.measurements import refit_exposures
from quarc_ref.format.cameras import Camera
from studies import Row, load_row, save_row, write_status


@dataclass(frozen=True, slots=True)
class Task:
    """A rung to fit to a frame.

    Attributes:
        rung: The fields that can change.
        ahead: How many frames after the start frame the fitted frame is.
        iterations: Number of iterations; 0 for the rung on which no field can change.
    """

    rung: Rung
    ahead: int
    iterations: int

    @property
    def name(self) -> str:
        """Name of the task, which is unique in a ladder."""
        return f"ahead{self.ahead}.{self.rung.name}.{self.iterations}"


def list_tasks(
    rungs: Sequence[Rung], ahead: Sequence[int], iterations: Sequence[int]
) -> list[Task]:
    """Return all tasks; those with the fewest iterations come first."""
    tasks = [
        Task(rung, distance, 0 if rung.name == STILL_NAME else count)
        for count in sorted(iterations)
        for distance in ahead
        for rung in rungs
    ]
    return list(dict.fromkeys(tasks))


class Ladder:
    """Computes and saves the rows of a ladder.

    Args:
        capture: Capture whose frames are fitted.
        cameras: Cameras of the stream.
        state: The decoded start frame.
        stream_sha256: SHA-256 of the stream that contains the start frame.
        config: Learning rates and losses.
        folder: Folder for the rows.
    """

    def __init__(
        self,
        capture: Capture,
        cameras: Sequence[Camera],
        state: State,
        stream_sha256: str,
        config: EncoderConfig,
        folder: Path,
    ) -> None:
        self._capture, self._cameras, self._folder = capture, cameras, folder
        self._state, self._config = state, config
        settings = [[name, f"{value}"] for name, value in list_settings(config)]
        self._shared_inputs = [capture.fingerprint, stream_sha256, state.scene.frame, settings]

    def load_task_row(self, task: Task) -> Row | None:
        """Return the saved row of a task; None if it is missing or has different inputs."""
        return load_row(self._row_path(task), self._compute_key(task))

    def compute_missing(self, tasks: Sequence[Task], context: TrainingContext) -> None:
        """Compute and save the rows that are missing.

        Raises:
            CaptureError: A picture cannot be read.
            StateError: A Gaussian has left the lattice.
            EncodeError: A residual exceeds the range of the format.
        """
        missing = [task for task in tasks if self.load_task_row(task) is None]
        write_status(f"{len(tasks) - len(missing)} of {len(tasks)} rows exist already")
        if not missing:
            return
        refit_exposures(context, self._state)
        judge = Judge(self._capture, self._cameras)
        for number, task in enumerate(missing):
            write_status(f"{task.name}: started; {number} of {len(missing)} rows are finished")
            row = self._make_row(task, context, judge)
            save_row(self._row_path(task), self._compute_key(task), row)
            moving_psnr = row["floats"]["training"]["moving_gain_psnr"]
            moving_text = (
                "nothing moves"
                if moving_psnr is None
                else f"PSNR {moving_psnr:.2f} dB in moving pixels"
            )
            write_status(
                f"{task.name}: {moving_text}, {row['coded_bytes']} bytes, {row['seconds']:.0f} s"
            )

    def _make_row(self, task: Task, context: TrainingContext, judge: Judge) -> Row:
        frame = self._state.scene.frame + task.ahead
        frame_start = allow_updates(begin_frame(self._state, 0))
        frame_start = replace(frame_start, scene=replace(frame_start.scene, frame=frame))
        start_time = time.monotonic()
        fit = fit_rung(context, frame_start, task.rung, task.iterations, self._config)
        seconds = time.monotonic() - start_time
        rounded = round_rung(frame_start, fit)
        return {
            "rung": task.rung.name,
            "title": task.rung.title,
            "free": sorted(task.rung.free),
            "frame": self._state.scene.frame,
            "ahead": task.ahead,
            "iterations": task.iterations,
            "gaussians": self._state.scene.count,
            "changed": rounded.change_counts,
            "coded_bytes": rounded.coded_bytes,
            "estimated_bytes": rounded.estimated_bytes,
            "rest_bytes": rounded.rest_bytes,
            "floats": judge.measure(to_splats(fit.attributes), frame),
            "rounded": judge.measure(rounded.splats, frame),
            "seconds": seconds,
        }

    def _row_path(self, task: Task) -> Path:
        return self._folder / "rows" / f"{task.name}.json"

    def _compute_key(self, task: Task) -> str:
        """Return a digest of everything that determines the row, except the code."""
        rung = task.rung
        rung_inputs = [sorted(rung.free), rung.uses_canonical_rates, rung.sh_rest_rate_factor]
        inputs = [*self._shared_inputs, rung_inputs, task.ahead, task.iterations]
        return hashlib.sha256(json.dumps(inputs).encode()).hexdigest()
