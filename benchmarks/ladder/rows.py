"""A row: one rung, fitted to one frame with a number of iterations, measured and kept."""

import hashlib
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ladder.fitting import fit_rung
from ladder.judging import Judge
from ladder.rounding import allow_updates, round_rung, to_splats
from ladder.rungs import STILL, Rung
from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder.reconstruct import begin_frame
from quarc_ref.decoder.state import State
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import list_settings
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.first_frame import refit_exposures
from quarc_ref.format.cameras import Camera
from studies import Row, load_row, save_row, write_status


@dataclass(frozen=True, slots=True)
class Task:
    """One fit.

    Attributes:
        rung: What is free.
        ahead: Number of frames from the decoded one to the fitted one.
        iterations: Number of iterations; 0 for the rung on which nothing is free.
    """

    rung: Rung
    ahead: int
    iterations: int

    @property
    def name(self) -> str:
        """Name that distinguishes it from other tasks."""
        return f"ahead{self.ahead}.{self.rung.name}.{self.iterations}"


def list_tasks(
    rungs: Sequence[Rung], ahead: Sequence[int], iterations: Sequence[int]
) -> list[Task]:
    """Return all fits, short ones first."""
    tasks = [
        Task(rung, far, 0 if rung.name == STILL else count)
        for count in sorted(iterations)
        for far in ahead
        for rung in rungs
    ]
    return list(dict.fromkeys(tasks))


class Ladder:
    """The rows of a ladder.

    Args:
        capture: Capture whose frames are fitted.
        cameras: Cameras of the stream.
        state: The decoded start frame.
        origin: Identifies the stream that it was decoded from.
        config: Rates and losses.
        folder: Folder of the rows.
    """

    def __init__(
        self,
        capture: Capture,
        cameras: Sequence[Camera],
        state: State,
        origin: str,
        config: EncoderConfig,
        folder: Path,
    ) -> None:
        self._capture, self._cameras, self._folder = capture, cameras, folder
        self._state, self._config = state, config
        settings = [[name, f"{value}"] for name, value in list_settings(config)]
        self._origin = [capture.fingerprint, origin, state.scene.frame, settings]

    def load(self, task: Task) -> Row | None:
        """Return the kept row of a task; None if there is none, or one of other inputs."""
        return load_row(self._path(task), self._key(task))

    def fill(self, tasks: Sequence[Task], context: TrainingContext) -> None:
        """Compute the missing rows.

        Raises:
            CaptureError: A picture cannot be read.
            StateError: A Gaussian has left the lattice.
            EncodeError: A residual exceeds the range of the format.
        """
        waiting = [task for task in tasks if self.load(task) is None]
        write_status(f"{len(tasks) - len(waiting)} of {len(tasks)} rows are there already")
        if not waiting:
            return
        refit_exposures(context, self._state)
        judge = Judge(self._capture, self._cameras)
        for number, task in enumerate(waiting):
            write_status(f"{task.name}: started; {number} of {len(waiting)} are finished")
            row = self._make(task, context, judge)
            save_row(self._path(task), self._key(task), row)
            moving = row["floats"]["training"]["moving_gain_psnr"]
            said = "nothing moves" if moving is None else f"{moving:.2f} dB where it moves"
            write_status(f"{task.name}: {said}, {row['coded_bytes']} bytes, {row['seconds']:.0f} s")

    def _make(self, task: Task, context: TrainingContext, judge: Judge) -> Row:
        frame = self._state.scene.frame + task.ahead
        start_state = allow_updates(begin_frame(self._state, 0))
        start_state = replace(start_state, scene=replace(start_state.scene, frame=frame))
        started = time.monotonic()
        fitted = fit_rung(context, start_state, task.rung, task.iterations, self._config)
        seconds = time.monotonic() - started
        rounded = round_rung(start_state, fitted)
        return {
            "rung": task.rung.name,
            "title": task.rung.title,
            "free": sorted(task.rung.free),
            "frame": self._state.scene.frame,
            "ahead": task.ahead,
            "iterations": task.iterations,
            "gaussians": self._state.scene.count,
            "changed": rounded.changed,
            "coded_bytes": rounded.coded_bytes,
            "estimated_bytes": rounded.estimated_bytes,
            "rest_bytes": rounded.rest_bytes,
            "floats": judge.measure(to_splats(fitted.attributes), frame),
            "rounded": judge.measure(rounded.splats, frame),
            "seconds": seconds,
        }

    def _path(self, task: Task) -> Path:
        return self._folder / "rows" / f"{task.name}.json"

    def _key(self, task: Task) -> str:
        """Return a digest of everything that the row depends on, except the code."""
        rung = task.rung
        rung_said = [sorted(rung.free), rung.canonical_learning_rates, rung.rest_factor]
        said = [*self._origin, rung_said, task.ahead, task.iterations]
        return hashlib.sha256(json.dumps(said).encode()).hexdigest()
