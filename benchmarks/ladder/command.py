"""The command line of benchmarks/ladder.py."""

import argparse
import hashlib
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from atomic_files import write_atomically
from expected_errors import EXPECTED_ERRORS
from ladder.rows import Ladder, Task, list_tasks
from ladder.rungs import RUNGS
from ladder.tables import format_rows
from options import add_set_option, parse_count, parse_positive
from quarc_ref.cli.encoder_options import make_config
from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.errors import TooFewFramesError
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.decoder.engine import REFERENCE
from quarc_ref.decoder.engines import use_engine
from quarc_ref.decoder.state import State
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import PRESETS, list_settings
from quarc_ref.encoder.training.context import make_context
from quarc_ref.encoder.training.torch_settings import fixed_torch_settings
from quarc_ref.evaluation.same_capture import MismatchError, open_same_capture
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.streams.decode_stream import decode_states
from studies import ProgressLines, write_status


@dataclass(frozen=True, slots=True, eq=False)
class StartFrame:
    """The frame at which the fitting of all rungs starts, and the ladder of these rungs.

    Attributes:
        capture: The capture, opened at the stream's resolution.
        state: Decoder state of the frame.
        ladder: The ladder, which computes the rows.
    """

    capture: Capture
    state: State
    ladder: Ladder


def main(command_line: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns:
        0 on success, 2 for invalid options, 130 after Ctrl-C.
    """
    arguments = _parse_arguments(command_line)
    tasks = list_tasks([RUNGS[name] for name in arguments.rungs], arguments.ahead,
                       arguments.iterations)  # fmt: skip
    try:
        config = make_config(arguments.preset, arguments.set, arguments.seed)
        with fixed_torch_settings():
            start = _open_start_frame(arguments, config)
            print(_compute_table(start, tasks, config, arguments.out), end="")
    except EXPECTED_ERRORS as error:
        write_status(f"ladder.py: {error}")
        return 2
    except KeyboardInterrupt:
        write_status("interrupted: run the same command again to compute the missing rows")
        return 130
    return 0


def _compute_table(
    start: StartFrame, tasks: list[Task], config: EncoderConfig, folder: Path
) -> str:
    """Compute the missing rows; write the table of all rows, and return it."""
    context = make_context(start.capture, "cpu", config.seed)
    start.ladder.compute_missing(tasks, context)
    rows = [row for task in tasks if (row := start.ladder.load_task_row(task)) is not None]
    rows.sort(key=lambda row: (row["ahead"], row["iterations"]))
    table = format_rows(rows)
    write_atomically(folder / "ladder.md", table.encode())
    return table


def _open_start_frame(arguments: argparse.Namespace, config: EncoderConfig) -> StartFrame:
    """Return the start frame of all rungs; without `--stream`, encode the capture up to that frame.

    Raises:
        MismatchError: The stream does not match the capture, or lacks the start frame.
        CaptureError: The capture cannot be read, or is too short.
        QuarcError: The stream is malformed or cannot be encoded.
        OSError: A file cannot be read or written.
    """
    path = arguments.stream or _encode_if_missing(arguments, config)
    data = path.read_bytes()
    summary = inspect_stream(data)
    capture = open_same_capture(summary, arguments.capture)
    last_frame = arguments.frame + max(arguments.ahead)
    if last_frame >= capture.frame_count:
        message = (
            f"frame {last_frame} is needed, but the capture has only {capture.frame_count} frames"
        )
        raise TooFewFramesError(message)
    with use_engine(REFERENCE):
        state = next(decode_states(data, arguments.frame, arguments.frame + 1), None)
    if not isinstance(state, State):
        message = f"the stream has no frame {arguments.frame}"
        raise MismatchError(message)
    stream_digest = hashlib.sha256(data).hexdigest()
    ladder = Ladder(capture, summary.cameras, state, stream_digest, config, arguments.out)
    return StartFrame(capture, state, ladder)


def _encode_if_missing(arguments: argparse.Namespace, config: EncoderConfig) -> Path:
    """Return the path of a stream up to the start frame; encode the stream if it does not exist."""
    capture = open_capture(arguments.capture, CaptureOptions(held_out=tuple(arguments.held_out)))
    names = [capture.cameras[index].name for index in capture.held_out]
    settings = [[name, f"{value}"] for name, value in list_settings(config)]
    key_inputs = json.dumps([capture.fingerprint, names, arguments.frame, settings])
    path: Path = (
        arguments.out / f"start.{hashlib.sha256(key_inputs.encode()).hexdigest()[:12]}.quarc"
    )
    if not path.is_file():
        write_status(
            f"encoding the capture up to frame {arguments.frame}; use --stream FILE to avoid this"
        )
        sink, progress = io.BytesIO(), ProgressLines("start")
        arguments.out.mkdir(parents=True, exist_ok=True)
        options = EncodeOptions(
            config,
            arguments.frame + 1,
            "cpu",
            progress,
            path.with_suffix(".training"),
            checks=False,
        )
        encode(capture, sink, options)
        write_atomically(path, sink.getvalue())
    return path


def _parse_arguments(command_line: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="ladder.py", description="Show which fields limit the quality of a frame."
    )
    add = parser.add_argument
    add("capture", type=Path, metavar="CAPTURE")
    add(
        "--stream",
        type=Path,
        metavar="FILE",
        help="stream of the capture; by default, encode the capture",
    )
    add(
        "--frame",
        type=parse_count,
        default=0,
        metavar="T",
        help="ordinal of the decoded start frame",
    )
    add(
        "--ahead",
        type=parse_positive,
        nargs="+",
        default=[1, 5],
        help="how many frames after T the fitted frames are",
    )
    add("--iterations", type=parse_positive, nargs="+", default=[300, 1000])
    add("--rungs", nargs="+", choices=list(RUNGS), default=list(RUNGS), metavar="NAME",
        help=f"rungs to compute: {', '.join(RUNGS)}")  # fmt: skip
    add(
        "--out",
        type=Path,
        default=Path("out/ladder"),
        metavar="DIR",
        help="folder for rows and table",
    )
    add("--preset", choices=sorted(PRESETS), default="main")
    add_set_option(parser)
    add("--held-out", action="append", default=[], metavar="CAMERA", help="camera to "
        "hold out; used only without --stream")  # fmt: skip
    add("--seed", type=parse_count, default=0)
    return parser.parse_args(command_line)
