"""Converts exceptions to messages and exit codes.

Exit code 0 means success. 1: the stream is invalid. 2: the command line is invalid: options
conflict, or a path does not exist or has the wrong type. 3: another error occurred, such as an
unreadable file or capture, a full disk, or a bug. After a signal, the exit code is 128 plus the
signal's number, as in a shell: 130 after Ctrl-C (SIGINT), 143 after SIGTERM, 141 if the reader of
a pipe has closed the pipe (SIGPIPE).
"""

import os
import select
import signal
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn, TextIO

import typer

from quarc_ref.cli.output import print_message
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.export.errors import NoFramesError
from quarc_ref.export.table import EXPORTS
from quarc_ref.files import OutputPathError
from quarc_ref.format.errors import (
    BitstreamError,
    EditError,
    EnvironmentVariableError,
    QuarcError,
    ResumeError,
    UnusableCaptureError,
)

STREAM_IS_BAD = 1
USAGE = 2
TOOL_FAILED = 3
_BY_SIGNAL = 128
_SIGPIPE = 13  # not defined by `signal` on Windows
_EXTRAS = {
    "gsplat": "gpu",
    "ray": "ray",
    "tensorboard": "tensorboard",
    **{row.package: row.extra for row in EXPORTS.values() if row.package and row.extra},
}
_NOTHING_LEFT = "interrupted; nothing was written"


class UsageError(Exception):
    """An option or a path is invalid, or options conflict."""


class Termination(KeyboardInterrupt):
    """The process received SIGTERM: work ends as after Ctrl-C, but with another exit code."""


@contextmanager
def report_errors() -> Iterator[None]:
    """Convert an exception of a command to a message on standard error and an exit code."""
    try:
        yield
        sys.stdout.flush()  # if flushing failed at exit, Python would return exit code 120
    except typer.Exit:
        _discard_output(sys.stdout)
        raise
    except (Exception, KeyboardInterrupt) as error:
        _exit_with(*_judge(error))


def install_sigterm_handler() -> None:
    """Handle SIGTERM like Ctrl-C, with cleanup."""
    signal.signal(signal.SIGTERM, _terminate)


def _terminate(_number: int, _frame: FrameType | None) -> NoReturn:
    raise Termination


def restore_sigterm_handler() -> None:
    """Restore the handler of SIGTERM, which pycolmap replaces when it is imported."""
    signal.signal(signal.SIGTERM, signal.getsignal(signal.SIGTERM))


def ensure_standard_streams() -> None:
    """Open the null device as standard output or standard error if the stream is closed."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115, kept open


def _discard_output(output: TextIO) -> None:
    """Flush an output; if that fails, redirect it so that flushing at exit does not fail."""
    try:
        output.flush()
    except OSError:
        with suppress(OSError):  # the output is not a file
            os.dup2(os.open(os.devnull, os.O_WRONLY), output.fileno())


def _name_extra(error: ImportError) -> str:
    extra = _EXTRAS.get(error.name or "", "encode")
    return (
        f"{error.name or error} cannot be imported; install it with: pip install "
        f"'quarc-ref[{extra}]'"
    )


def _describe_bad_name(error: UnicodeEncodeError) -> str:
    encoding = error.encoding.upper()
    return f"the name {error.object!r} is not valid {encoding}: rename the file or folder"


def _suggest_no_checks(error: UnusableCaptureError) -> str:
    return f"{error}: use --no-checks to encode the capture nevertheless"


def _suggest_force(error: OutputPathError) -> str:
    return f"{error}: use --force to replace it" if error.replaceable else str(error)


def _describe_rejection(error: BitstreamError) -> str:
    return "; ".join([f"the stream is rejected: {error}", *getattr(error, "__notes__", [])])


def _describe_error(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return f"there is not enough memory: {error}" if str(error) else "out of memory"
    if isinstance(error, OSError) and error.strerror:
        place = f"{error.filename}: " if error.filename else ""
        return f"{place}{error.strerror}"
    return str(error) or repr(error)


_FAULTS: tuple[tuple[tuple[type[BaseException], ...], int, Callable[[Any], str]], ...] = (
    ((BitstreamError,), STREAM_IS_BAD, _describe_rejection),
    ((UsageError, EditError, ResumeError, NoFramesError), USAGE, str),
    ((EnvironmentVariableError,), USAGE, str),
    ((OutputPathError,), USAGE, _suggest_force),
    ((UnusableCaptureError,), TOOL_FAILED, _suggest_no_checks),
    ((ImportError,), TOOL_FAILED, _name_extra),
    ((UnicodeEncodeError,), TOOL_FAILED, _describe_bad_name),
    ((CaptureError, QuarcError, OSError, RuntimeError, MemoryError), TOOL_FAILED, _describe_error),
)


def _judge(error: BaseException) -> tuple[str, int]:
    """Return the message, which may be empty, and the exit code of an exception."""
    if isinstance(error, KeyboardInterrupt):
        return str(error) or _NOTHING_LEFT, _BY_SIGNAL + _name_signal(error)
    if isinstance(error, BrokenPipeError) and any(map(_has_no_reader, (sys.stdout, sys.stderr))):
        return "", _BY_SIGNAL + _SIGPIPE
    for kinds, code, say in _FAULTS:
        if isinstance(error, kinds):
            return say(error), code
    traceback.print_exception(error)  # Python's own exit code 1 would mean an invalid stream
    return f"internal error: {error!r}", TOOL_FAILED


def _name_signal(error: BaseException | None) -> signal.Signals:
    """Return the signal that caused an exception: SIGTERM or SIGINT."""
    while error is not None:
        if isinstance(error, Termination):
            return signal.SIGTERM
        error = error.__cause__
    return signal.SIGINT


def _has_no_reader(output: TextIO) -> bool:
    """Return whether an output is a pipe without a reader."""
    if sys.platform == "win32":
        return True
    watch = select.poll()
    try:
        watch.register(output, 0)
    except OSError:  # the output is not a file
        return False
    return bool(watch.poll(0))


def _exit_with(message: str, code: int) -> NoReturn:
    _discard_output(sys.stdout)
    if message:
        with suppress(OSError):  # if standard error fails, only the exit code reports the error
            print_message(message)
    _discard_output(sys.stderr)
    raise typer.Exit(code)
