"""Opens the monitors of an encode: terminal status, `--log-json` and `--tensorboard`."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from quarc_ref.cli.output import TerminalProgress
from quarc_ref.cli.targets import require_writable_file
from quarc_ref.files import open_log
from quarc_ref.wording import format_count

if TYPE_CHECKING:
    from quarc_ref.encoder.monitoring.monitor import EncodePlan, Estimate, Monitor

_MIN_ANNOUNCED_SECONDS = 10.0
_MEGABYTE = 1e6


@dataclass(frozen=True, slots=True)
class LogOptions:
    """Options of the logs that an encode writes.

    Attributes:
        json: Path of the JSON Lines log; None to write no JSON Lines log.
        tensorboard: Folder of TensorBoard logs; None to write no TensorBoard logs.
        keep: Whether to append to an existing JSON Lines log.
        force: Whether to replace an existing JSON Lines log.
    """

    json: Path | None
    tensorboard: Path | None
    keep: bool
    force: bool


@contextmanager
def open_monitors(logs: LogOptions, progress: TerminalProgress) -> "Iterator[Monitor]":
    """Open the logs of an encode, and show its status on the terminal.

    Raises:
        UsageError: The JSON Lines log exists, and neither `keep` nor `force` is set.
        ImportError: TensorBoard is requested but not installed.
        OSError: A log cannot be written.
    """
    from quarc_ref.encoder.monitoring.json_log import JsonLog
    from quarc_ref.encoder.monitoring.monitor import MonitorGroup
    from quarc_ref.encoder.monitoring.status import EncodeStatus

    monitors: list[Monitor] = []
    with ExitStack() as stack:
        if progress.is_shown:
            status = EncodeStatus(lambda *arguments: _announce_estimate(progress, *arguments))
            progress.show_status(status.describe)
            monitors.append(status)
        if logs.json is not None:
            monitors.append(JsonLog(stack.enter_context(_open_json_log(logs.json, logs))))
        if logs.tensorboard is not None:
            from quarc_ref.encoder.monitoring.tensorboard_log import TensorBoardLog

            tensorboard_log = TensorBoardLog(logs.tensorboard)
            stack.callback(tensorboard_log.close)
            monitors.append(tensorboard_log)
        yield MonitorGroup(monitors)


@contextmanager
def _open_json_log(path: Path, logs: LogOptions) -> Iterator[TextIO]:
    require_writable_file(path, force=logs.force or logs.keep)
    with open_log(path, keep=logs.keep) as sink:
        yield sink


def _announce_estimate(
    progress: TerminalProgress, plan: "EncodePlan", estimate: "Estimate"
) -> None:
    """Print the estimated time and size of an encode, if it will take over 10 seconds."""
    from quarc_ref.encoder.monitoring.status import format_duration

    if estimate.seconds < _MIN_ANNOUNCED_SECONDS:
        return
    progress.announce(
        f"{format_count(plan.frames, 'frame')} of {plan.capture}, "
        f"{format_count(plan.views, 'training camera')}: about "
        f"{format_duration(estimate.seconds)}, and {_format_megabytes(estimate.byte_count)} MB "
        "(the time may be off by a factor of two, the size by a factor of three)"
    )


def _format_megabytes(byte_count: float) -> str:
    """Format a rough size with one significant digit, and without an exponent."""
    megabytes = float(f"{byte_count / _MEGABYTE:.1g}")
    return f"{megabytes:,.6f}".rstrip("0").rstrip(".")
