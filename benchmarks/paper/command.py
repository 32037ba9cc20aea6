"""The command line of benchmarks/paper.py."""

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from kept_files import write_atomically
from options import add_capture_options, add_set_option
from paper.experiments import EXPERIMENTS, Experiment, list_experiments, list_trials
from paper.results import write_results
from paper.rows import Task, make_row
from paper.scenes import format_scenes, write_scenes_csv
from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder.encode_stream import adapt_steps_to_capture
from quarc_ref.encoder.settings.config import EncoderConfig, StepSettings
from quarc_ref.encoder.settings.presets import PRESETS, change_setting, choose_preset
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.format.errors import EncodeError
from quarc_ref.jobs import Job, JobsError, WorkerPool
from studies import Row, note, run_missing


@dataclass(frozen=True, slots=True)
class Study:
    """All trials on one capture.

    Attributes:
        capture: Its name.
        fingerprint: Of its files.
        preset: Settings of the full method: preset and changes.
        experiments: What is compared.
        tasks: A task for each trial.
        folder: Folder of all files.
    """

    capture: str
    fingerprint: str
    preset: str
    experiments: list[Experiment]
    tasks: list[Task]
    folder: Path

    def rows(self) -> dict[str, Row]:
        """Return the completed rows by name, each with the changes of its trial."""
        base = self.tasks[0].trial.config
        done = {}
        for task in self.tasks:
            row = task.recall(self.fingerprint)
            if row is not None:
                done[task.trial.name] = row | {"changes": task.trial.list_changes(base)}
        return done

    def write(self) -> Path | None:
        """Write the tables and plots so far; return the page, or None before the first row."""
        rows = self.rows()
        if not rows:
            return None
        return write_results(self.experiments, rows, self.folder, self.capture, self.preset)


def run_study(study: Study, pool: WorkerPool) -> None:
    """Run the missing trials; tables and page are updated from time to time.

    Raises:
        JobsError: Some trials failed; all others are complete.
    """
    done = study.rows()
    waiting = [task for task in study.tasks if task.trial.name not in done]
    note(f"{len(done)} of {len(study.tasks)} rows are there already")
    jobs = [Job(task.trial.name, task) for task in waiting]
    run_missing(make_row, jobs, pool, study.write)


def plan_studies(arguments: argparse.Namespace) -> list[Study]:
    """Return a study for each requested capture.

    Each of several captures has a folder, named after the capture and its parent folder.

    Raises:
        ValueError: As for `plan_study`, or two captures have the same name.
        CaptureError: A capture cannot be read.
    """
    captures = [path.resolve() for path in arguments.capture]
    if len(captures) == 1:
        return [plan_study(arguments, captures[0], arguments.out)]
    folders = [arguments.out / path.parent.name / path.name for path in captures]
    if len(set(folders)) < len(folders):
        message = "two captures have the same name, and parent folders of the same name"
        raise ValueError(message)
    return [
        plan_study(arguments, capture, folder)
        for capture, folder in zip(captures, folders, strict=True)
    ]


def write_scenes(studies: Sequence[Study], out: Path) -> str:
    """Write the tables of several captures and return them as Markdown."""
    scenes = {(study.folder.parent.name, study.folder.name): study.rows() for study in studies}
    experiments = studies[0].experiments
    text = format_scenes(experiments, scenes)
    write_atomically(out / "scenes.md", text.encode())
    write_atomically(out / "scenes.csv", write_scenes_csv(experiments, scenes))
    return text


def plan_study(arguments: argparse.Namespace, folder: Path, out: Path) -> Study:
    """Return the study of one capture.

    Args:
        arguments: Parsed command line.
        folder: Of the capture.
        out: Folder of all files.

    Raises:
        ValueError: A preset, a setting, an experiment or a camera does not exist.
        CaptureError: The capture cannot be read.
    """
    options = CaptureOptions(arguments.downscale, tuple(arguments.held_out))
    capture = open_capture(folder, options)
    base = _make_base_config(arguments, capture)
    experiments = list_experiments(base, arguments.only)
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


def main(words: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns:
        0; 2 for impossible options, 3 if some trials failed.
    """
    arguments = _parse_arguments(words)
    try:
        if arguments.lpips:
            Lpips(arguments.lpips)  # reject a bad file now, not after the first hour
        studies = plan_studies(arguments)
        pool = WorkerPool(arguments.workers, arguments.threads, arguments.ray)
    except (ValueError, CaptureError, EncodeError) as error:
        note(f"paper.py: {error}")
        return 2
    code = 0
    for study in studies:
        note(f"{study.capture}:")
        try:
            run_study(study, pool)
        except JobsError as error:
            note(str(error))
            code = 3
        study.write()
    _show(studies, arguments)
    return code


def _show(studies: Sequence[Study], arguments: argparse.Namespace) -> None:
    """Write the results of all captures, and print them."""
    tables = write_scenes(studies, arguments.out) if len(studies) > 1 else ""
    if arguments.json:
        print(json.dumps([row for study in studies for row in study.rows().values()], indent=1))
        return
    if tables:
        print(tables)
    for study in studies:
        if study.rows():
            if not tables:
                print((study.folder / "paper.md").read_text())
            print(study.folder / "index.html")


def _make_base_config(arguments: argparse.Namespace, capture: Capture) -> EncoderConfig:
    """Return the settings of the full method, with steps adapted to the capture in world units."""
    config = choose_preset(arguments.preset)
    for setting in [*arguments.set, f"seed={arguments.seed}"]:
        name, _, value = setting.partition("=")
        config = change_setting(config, name, value)
    return replace(adapt_steps_to_capture(config, capture), steps=StepSettings())


def _parse_arguments(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="paper.py",
        description="Run the paper's experiments on captures: tables, plots and one page to each.",
    )
    add = parser.add_argument
    add(
        "capture",
        type=Path,
        nargs="+",
        metavar="CAPTURE",
        help="a folder; quarc-ref synth makes one. Several captures, such as data/N3DV/*, "
        "also get a common table with their mean",
    )
    add("--out", type=Path, default=Path("out/paper"), metavar="DIR", help="kept between runs")
    add("--preset", choices=sorted(PRESETS), default="main", help="the full method")
    add_set_option(parser)
    add_capture_options(parser)
    add("--seed", type=int, default=0)
    add("--only", type=_split, default=[], metavar="NAMES", help=f"some of {','.join(EXPERIMENTS)}")
    add("--lpips", type=Path, metavar="WEIGHTS", help="file of LPIPS's state_dict, VGG16")
    add("--device", choices=("auto", "cpu", "cuda"), default="cpu")
    add("--workers", type=int, default=1, help="number of parallel trials")
    add("--threads", type=int, default=1, help="of every trial")
    add("--ray", metavar="ADDRESS", help="run on a Ray cluster: HOST:PORT, auto or local")
    add("--json", action="store_true", help="print the rows as JSON")
    return parser.parse_args(words)


def _split(text: str) -> list[str]:
    return [name for name in text.split(",") if name]
