"""The command line of benchmarks/quality.py."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

from options import add_set_option, add_study_options, make_pool, parse_positive, split_names
from quality.comparison import compare_studies
from quality.groups import Group, group_rows
from quality.results import format_groups, write_results
from quality.rows import Task, make_row
from quality.study_captures import (
    DEFAULT_TRACED_NAMES,
    StudyCapture,
    choose_held_out_sets,
    parse_traced_name,
    trace_if_missing,
)
from quarc_ref.cli.encoder_options import make_config
from quarc_ref.cli.errors import UsageError
from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import PRESETS
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.jobs import Job, WorkerPool
from studies import Row, run_missing, write_status


@dataclass(frozen=True, slots=True)
class Study:
    """All encodes of a study.

    Attributes:
        settings: Preset and changed settings, as text.
        tasks: Tasks, ordered by capture, held-out set and seed.
        fingerprints: Fingerprints of the captures, by name.
        folder: Folder for all files of the study.
    """

    settings: str
    tasks: list[Task]
    fingerprints: dict[str, str]
    folder: Path

    def run(self, pool: WorkerPool) -> int:
        """Run the tasks that have no row yet, and write the results; see `run_missing`."""
        missing = [task for task in self.tasks if self._load_row(task) is None]
        write_status(f"{len(self.tasks) - len(missing)} of {len(self.tasks)} rows exist already")
        jobs = [Job(task.name, task) for task in missing]
        return run_missing(make_row, jobs, pool, self.write_tables)

    def load_groups(self) -> list[Group]:
        """Return the completed rows, grouped by capture and held-out set."""
        rows = (self._load_row(task) for task in self.tasks)
        return group_rows(row for row in rows if row is not None)

    def write_tables(self) -> None:
        """Write all result files from the completed rows."""
        groups = self.load_groups()
        if groups:
            write_results(groups, self.settings, self.folder)

    def _load_row(self, task: Task) -> Row | None:
        return task.load_saved_row(self.fingerprints[task.capture])


def plan_study(arguments: argparse.Namespace) -> Study:
    """Return the study that the options describe; ray-trace its missing captures first.

    Raises:
        ValueError: A variant, the preset or a setting does not exist, no capture is given, or LPIPS
            cannot be measured with these weights or on these pictures.
        CaptureError: A capture cannot be read.
    """
    lpips = Lpips(arguments.lpips) if arguments.lpips else None
    config = make_config(arguments.preset, arguments.set, 0)  # each task has its own seed
    tasks, fingerprints = [], {}
    for study_capture in _prepare_captures(arguments):
        capture = open_capture(study_capture.folder, CaptureOptions(arguments.downscale))
        if lpips is not None:
            held_out = set(chain.from_iterable(study_capture.held_out_sets))
            lpips.require_sizes(camera for camera in capture.cameras if camera.name in held_out)
        fingerprints[study_capture.name] = capture.fingerprint
        tasks += _list_tasks(arguments, study_capture, capture, config)
    settings = ", ".join([arguments.preset, *arguments.set])
    return Study(settings, tasks, fingerprints, arguments.out)


def main(command_line: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns:
        0 on success, 2 for invalid options, 3 if some encodes failed, 130 after Ctrl-C.
    """
    arguments = _parse_arguments(command_line)
    try:
        if arguments.against:
            print(compare_studies(arguments.out, arguments.against))
            return 0
        pool = make_pool(arguments)
        study = plan_study(arguments)
    except (ValueError, CaptureError, UsageError) as error:
        write_status(f"quality.py: {error}")
        return 2
    exit_code = study.run(pool)
    print(format_groups(study.load_groups()))
    return exit_code


def _prepare_captures(arguments: argparse.Namespace) -> list[StudyCapture]:
    study_captures = []
    if arguments.real:
        names = [camera.name for camera in open_capture(arguments.real).cameras]
        study_captures.append(
            StudyCapture("real", arguments.real.resolve(), choose_held_out_sets(names))
        )
    if arguments.still:
        first_camera = open_capture(arguments.still).cameras[0].name
        study_captures.append(StudyCapture("still", arguments.still.resolve(), ((first_camera,),)))
    for name in arguments.variants:
        parse_traced_name(name)  # rejects a malformed name before any capture is traced
    traced_folder = (arguments.captures or arguments.out / "captures").resolve()
    study_captures += [trace_if_missing(name, traced_folder) for name in arguments.variants]
    if not study_captures:
        message = "no capture is given: use --real, --still or --variants"
        raise ValueError(message)
    return study_captures


def _list_tasks(
    arguments: argparse.Namespace,
    study_capture: StudyCapture,
    capture: Capture,
    config: EncoderConfig,
) -> list[Task]:
    """Return the tasks of a capture; each encodes the requested frames, or all if fewer exist."""
    return [
        Task(
            study_capture.name,
            set_number,
            study_capture.folder,
            CaptureOptions(arguments.downscale, held_out),
            replace(config, seed=seed),
            min(arguments.frames, capture.frame_count),
            arguments.out.resolve(),
            arguments.lpips,
            arguments.device,
        )
        for set_number, held_out in enumerate(study_capture.held_out_sets)
        for seed in range(arguments.seeds)
    ]


def _parse_arguments(command_line: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="quality.py",
        description="Measure picture quality for captures, held-out sets and seeds.",
    )
    add = parser.add_argument
    add(
        "--out",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder for results; a run continues with the results that are already there",
    )
    add(
        "--real",
        type=Path,
        metavar="DIR",
        help="capture to encode with up to four sets of held-out cameras",
    )
    add(
        "--still", type=Path, metavar="DIR", help="capture to encode with its first camera held out"
    )
    add(
        "--variants",
        type=split_names,
        default=list(DEFAULT_TRACED_NAMES),
        metavar="NAMES",
        help="comma-separated ray-traced captures VARIANT[-CAMERAS][-WIDTHxHEIGHT]; default: "
        f"{','.join(DEFAULT_TRACED_NAMES)}",
    )
    add(
        "--captures",
        type=Path,
        metavar="DIR",
        help="folder of ray-traced captures; default: `captures` in --out",
    )
    add(
        "--frames",
        type=parse_positive,
        default=1,
        help="number of frames of every encode; default: 1",
    )
    add(
        "--seeds",
        type=parse_positive,
        default=5,
        help="number of seeds, starting at 0; default: 5",
    )
    add("--preset", choices=sorted(PRESETS), default="main")
    add_set_option(parser)
    add("--downscale", type=parse_positive, default=1, help="downscale pictures by this factor")
    add_study_options(parser)
    add(
        "--against",
        type=Path,
        metavar="OTHER",
        help="do not encode; subtract the results in OTHER from those in --out",
    )
    return parser.parse_args(command_line)
