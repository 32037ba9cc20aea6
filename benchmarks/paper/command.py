"""Implements the command line of `benchmarks/paper.py`."""

import argparse
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from atomic_files import write_atomically
from options import (
    add_capture_options,
    add_set_option,
    add_study_options,
    make_pool,
    parse_count,
    split_names,
)
from paper.experiments import EXPERIMENTS, Experiment, list_experiments, list_trials
from paper.results import write_results
from paper.rows import Task, make_row
from paper.scenes import format_scenes, format_scenes_csv
from quarc_ref.cli.encoder_options import make_config
from quarc_ref.cli.errors import UsageError
from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder.adapt_steps import adapt_steps_to_capture
from quarc_ref.encoder.settings.config import EncoderConfig, StepSettings
from quarc_ref.encoder.settings.presets import PRESETS
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.format.errors import EncodeError
from quarc_ref.jobs import Job, WorkerPool
from studies import INTERRUPTED, Row, run_missing, write_status


@dataclass(frozen=True, slots=True)
class Study:
    """The experiments on one capture.

    Attributes:
        capture: Name of the capture.
        fingerprint: Fingerprint of the capture's files.
        preset: Preset and changed settings of the full method, as text.
        experiments: Experiments to run; each compares several trials.
        tasks: One task for each trial of the experiments.
        folder: Folder for all files of the study.
    """

    capture: str
    fingerprint: str
    preset: str
    experiments: list[Experiment]
    tasks: list[Task]
    folder: Path

    def load_rows(self) -> dict[str, Row]:
        """Return the completed rows by trial name, with the changed settings of each trial."""
        base_config = self.tasks[0].trial.config
        completed_rows = {}
        for task in self.tasks:
            row = task.load_saved_row(self.fingerprint)
            if row is not None:
                completed_rows[task.trial.name] = row | {
                    "changes": task.trial.list_changes(base_config)
                }
        return completed_rows

    def write_results(self) -> Path | None:
        """Write the results of the completed rows; return the page's path, or None without rows."""
        rows = self.load_rows()
        if not rows:
            return None
        return write_results(self.experiments, rows, self.folder, self.capture, self.preset)


def run_study(study: Study, pool: WorkerPool) -> int:
    """Run the trials that have no row yet, and write the results; see `run_missing`."""
    completed_rows = study.load_rows()
    missing_tasks = [task for task in study.tasks if task.trial.name not in completed_rows]
    write_status(f"{len(completed_rows)} of {len(study.tasks)} rows already exist")
    jobs = [Job(task.trial.name, task) for task in missing_tasks]
    return run_missing(make_row, jobs, pool, study.write_results)


def plan_studies(arguments: argparse.Namespace) -> list[Study]:
    """Return a study for each requested capture.

    If there are several captures, the results of each are written to OUT/PARENT/NAME, where NAME is
    the name of the capture's folder and PARENT that of its parent folder.

    Raises:
        ValueError: Two captures have the same NAME and PARENT, or an option is invalid (see
            `plan_study`).
        CaptureError: A capture cannot be read.
    """
    # Links are kept, because a folder of scenes often consists of links to other disks.
    captures = [Path(os.path.abspath(path)) for path in arguments.capture]
    if len(captures) == 1:
        return [plan_study(arguments, captures[0], arguments.out)]
    folders = [arguments.out / path.parent.name / path.name for path in captures]
    if len(set(folders)) < len(folders):
        message = (
            "two captures have the same folder name, and their parent folders have the same name"
        )
        raise ValueError(message)
    return [
        plan_study(arguments, capture, folder)
        for capture, folder in zip(captures, folders, strict=True)
    ]


def write_scenes(studies: Sequence[Study], out: Path) -> str:
    """Write the tables that compare several captures, and return them as Markdown."""
    rows_by_scene = {
        (study.folder.parent.name, study.folder.name): study.load_rows() for study in studies
    }
    experiments = studies[0].experiments
    text = format_scenes(experiments, rows_by_scene)
    write_atomically(out / "scenes.md", text.encode())
    write_atomically(out / "scenes.csv", format_scenes_csv(experiments, rows_by_scene))
    return text


def plan_study(arguments: argparse.Namespace, folder: Path, out: Path) -> Study:
    """Return the study of one capture.

    Args:
        arguments: Parsed command line.
        folder: Folder of the capture.
        out: Folder for all files of the study.

    Raises:
        ValueError: The preset, a setting, an experiment or a camera does not exist, or LPIPS cannot
            be measured with the given weights or on pictures of this size.
        CaptureError: The capture cannot be read.
    """
    options = CaptureOptions(arguments.downscale, tuple(arguments.held_out))
    capture = open_capture(folder, options)
    if arguments.lpips:
        Lpips(arguments.lpips).require_sizes(capture.cameras[index] for index in capture.held_out)
    base_config = _make_base_config(arguments, capture)
    experiments = list_experiments(base_config, arguments.only)
    frames = capture.require_frames(arguments.frames)
    tasks = [
        Task(
            trial,
            folder.resolve(),
            options,
            frames,
            out.resolve(),
            arguments.lpips,
            arguments.device,
        )
        for trial in list_trials(experiments)
    ]
    name, preset = capture.name, ", ".join([arguments.preset, *arguments.set])
    return Study(name, capture.fingerprint, preset, experiments, tasks, out)


def main(command_line: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns:
        0 on success, 2 for invalid options, 3 if some trials failed, 130 after Ctrl-C.
    """
    arguments = _parse_arguments(command_line)
    try:
        studies = plan_studies(arguments)
        pool = make_pool(arguments)
    except (ValueError, CaptureError, EncodeError, UsageError) as error:
        write_status(f"paper.py: {error}")
        return 2
    exit_code = 0
    for study in studies:
        write_status(f"{study.capture}:")
        exit_code = max(exit_code, run_study(study, pool))
        if exit_code == INTERRUPTED:
            break
    _print_results(studies, arguments)
    return exit_code


def _print_results(studies: Sequence[Study], arguments: argparse.Namespace) -> None:
    """Print all results; for several captures, also write the tables that compare them."""
    tables = write_scenes(studies, arguments.out) if len(studies) > 1 else ""
    if arguments.json:
        print(
            json.dumps([row for study in studies for row in study.load_rows().values()], indent=1)
        )
        return
    if tables:
        print(tables)
    for study in studies:
        if study.load_rows():
            if not tables:
                print((study.folder / "paper.md").read_text())
            print(study.folder / "index.html")


def _make_base_config(arguments: argparse.Namespace, capture: Capture) -> EncoderConfig:
    """Return the settings of the full method, with quantization steps adapted to the capture."""
    config = make_config(arguments.preset, arguments.set, arguments.seed)
    return replace(adapt_steps_to_capture(config, capture), steps=StepSettings())


def _parse_arguments(command_line: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="paper.py",
        description="Run the experiments of the QuARC-GS paper; write tables, plots and pages.",
    )
    add = parser.add_argument
    add(
        "capture",
        type=Path,
        nargs="+",
        metavar="CAPTURE",
        help="folder of a capture, such as one written by quarc-ref synth; if there are several, "
        "such as data/N3DV/*, a table of all captures and their mean is written as well",
    )
    add(
        "--out",
        type=Path,
        default=Path("out/paper"),
        metavar="DIR",
        help="folder for results; a run continues with the results that are already there "
        "(default: %(default)s)",
    )
    add(
        "--preset",
        choices=sorted(PRESETS),
        default="main",
        help="preset of the full method (default: %(default)s)",
    )
    add_set_option(parser)
    add_capture_options(parser)
    add(
        "--seed",
        type=parse_count,
        default=0,
        help="seed of all random numbers (default: %(default)s)",
    )
    add(
        "--only",
        type=split_names,
        default=[],
        metavar="NAMES",
        help=f"comma-separated experiments to run (default: all): {','.join(EXPERIMENTS)}",
    )
    add_study_options(parser)
    add("--json", action="store_true", help="print the rows as JSON")
    return parser.parse_args(command_line)
