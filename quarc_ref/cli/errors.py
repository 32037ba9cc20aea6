"""Converts exceptions to messages and exit codes.

The exit code is 0 after success, and 1 if the stream is invalid. Exit code 2 means that the command
line is invalid, for example because options conflict or a path does not exist. Exit code 3 means
any other error, such as an unreadable file or capture, a full disk, or a bug. After a signal, the
exit code is 128 plus the signal's number, as in a shell: 130 after Ctrl-C (SIGINT), 143 after
SIGTERM, 141 if the reader of a pipe has closed the pipe (SIGPIPE).
"""

import errno
import io
import os
import select
import signal
import stat
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn, TextIO

import typer

from quarc_ref.cli.output import print_message
from quarc_ref.cli.signals import SIGNAL_BASE, Termination, raise_on_signals
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.export.errors import NoFramesError
from quarc_ref.export.table import EXPORT_FORMATS
from quarc_ref.files import OutputPathError
from quarc_ref.format.errors import (
    BitstreamError,
    EditError,
    EnvironmentVariableError,
    QuarcError,
    ResumeError,
    TruncatedError,
    UnusableCaptureError,
)
from quarc_ref.wording import suggest_install

EXIT_INVALID_STREAM = 1
EXIT_USAGE = 2
EXIT_FAILURE = 3
_SIGPIPE = 13  # not defined by `signal` on Windows
_EXTRA_BY_PACKAGE = {
    "gsplat": "gpu",
    "ray": "ray",
    "tensorboard": "tensorboard",
    **{
        export.package: export.extra
        for export in EXPORT_FORMATS.values()
        if export.package and export.extra
    },
}
_MISSING_PYCOLMAP = (
    "pycolmap, which is needed for COLMAP's files, for calibrate and for captures without initial "
    f"points, cannot be imported; {suggest_install('media')}. If PyPI has no wheel of pycolmap for "
    "this system, use conda-forge or build it"
)
_INTERRUPTED_MESSAGE = "interrupted; nothing new was written"


class UsageError(Exception):
    """An option or a path is invalid, or options conflict."""


@contextmanager
def report_errors() -> Iterator[None]:
    """Convert an exception of a command to a message on standard error and an exit code."""
    try:
        raise_on_signals()
        yield
        sys.stdout.flush()  # if flushing failed at exit, Python would return exit code 120
    except typer.Exit:
        _flush_or_discard(sys.stdout)
        raise
    except (Exception, KeyboardInterrupt) as error:
        _exit_with(*_get_message_and_code(error))


@contextmanager
def report_failed_output() -> Iterator[None]:
    """Convert a failed write of a help text or a usage error to a message and an exit code.

    typer, rich and Python exit with code 1, which means that a stream is rejected.
    """
    try:
        yield
    except SystemExit as error:
        if isinstance(error.__context__, BrokenPipeError):
            raise SystemExit(SIGNAL_BASE + _SIGPIPE) from error
        raise
    except OSError as error:
        message, code = _get_message_and_code(error)
        _discard_and_print(message)
        raise SystemExit(code) from error


def ensure_standard_streams() -> None:
    """Prepare standard output and standard error for any text, even if they are closed.

    If one is closed, it is replaced with the null device. Characters that its encoding does not
    have are escaped.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115, kept open
        output = getattr(sys, name)
        if isinstance(output, io.TextIOWrapper):
            output.reconfigure(errors="backslashreplace")


def _flush_or_discard(output: TextIO) -> None:
    """Flush an output; if that fails, redirect it so that flushing at exit does not fail."""
    try:
        output.flush()
    except OSError:
        with suppress(OSError):  # the output is not a file
            os.dup2(os.open(os.devnull, os.O_WRONLY), output.fileno())


def _suggest_extra(error: ImportError) -> str:
    if error.name == "pycolmap":
        return _MISSING_PYCOLMAP
    extra = _EXTRA_BY_PACKAGE.get(error.name or "", "encode")
    return f"{error.name or error} cannot be imported; {suggest_install(extra)}"


def _describe_bad_name(error: UnicodeEncodeError) -> str:
    encoding = error.encoding.upper()
    return f"the name {error.object!r} is not valid {encoding}: rename the file or folder"


def _suggest_no_checks(error: UnusableCaptureError) -> str:
    return f"{error}: use --no-checks to encode the capture anyway"


def _suggest_force(error: OutputPathError) -> str:
    return f"{error}: use --force to replace it" if error.replaceable else str(error)


def _describe_rejection(error: BitstreamError) -> str:
    notes = list(getattr(error, "__notes__", []))
    if isinstance(error, TruncatedError):
        notes.append("its end is missing: copy it again, or finish its encode with encode --resume")
    return "; ".join([f"the stream is rejected: {error}", *notes])


def _describe_error(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return f"there is not enough memory: {error}" if str(error) else "out of memory"
    if isinstance(error, OSError) and error.strerror:
        prefix = f"{error.filename}: " if error.filename else ""
        return f"{prefix}{error.strerror}"
    return str(error) or repr(error)


_ERROR_HANDLERS: tuple[tuple[tuple[type[BaseException], ...], int, Callable[[Any], str]], ...] = (
    ((BitstreamError,), EXIT_INVALID_STREAM, _describe_rejection),
    ((UsageError, EditError, ResumeError, NoFramesError), EXIT_USAGE, str),
    ((EnvironmentVariableError,), EXIT_USAGE, str),
    ((OutputPathError,), EXIT_USAGE, _suggest_force),
    ((UnusableCaptureError,), EXIT_FAILURE, _suggest_no_checks),
    ((ImportError,), EXIT_FAILURE, _suggest_extra),
    ((UnicodeEncodeError,), EXIT_FAILURE, _describe_bad_name),
    ((CaptureError, QuarcError, OSError, RuntimeError, MemoryError), EXIT_FAILURE, _describe_error),
)


def _get_message_and_code(error: BaseException) -> tuple[str, int]:
    """Return the message, which may be empty, and the exit code of an exception."""
    if isinstance(error, KeyboardInterrupt):
        return str(error) or _INTERRUPTED_MESSAGE, SIGNAL_BASE + _find_signal(error)
    if _is_broken_pipe(error) and any(map(_has_no_reader, (sys.stdout, sys.stderr))):
        return "", SIGNAL_BASE + _SIGPIPE
    for error_types, code, describe in _ERROR_HANDLERS:
        if isinstance(error, error_types):
            return describe(error), code
    traceback.print_exception(error)  # Python's own exit code 1 would mean an invalid stream
    return f"internal error: {error!r}", EXIT_FAILURE


def _find_signal(error: BaseException | None) -> signal.Signals:
    """Return the signal that caused an exception: SIGTERM or SIGINT."""
    while error is not None:
        if isinstance(error, Termination):
            return signal.SIGTERM
        error = error.__cause__
    return signal.SIGINT


def _is_broken_pipe(error: BaseException) -> bool:
    """Return whether an error may be that of a write to a pipe without a reader."""
    if sys.platform == "win32":  # its C library reports this as an invalid argument
        return isinstance(error, OSError) and error.errno in (errno.EPIPE, errno.EINVAL)
    return isinstance(error, BrokenPipeError)


def _has_no_reader(output: TextIO) -> bool:
    """Return whether an output is a pipe without a reader; on Windows, whether it is a pipe."""
    try:
        if sys.platform == "win32":
            return stat.S_ISFIFO(os.fstat(output.fileno()).st_mode)
        poller = select.poll()
        poller.register(output, select.POLLOUT)  # macOS reports no state unless an event is asked
    except OSError:  # the output is not a file
        return False
    return any(state & ~select.POLLOUT for _, state in poller.poll(0))


def _exit_with(message: str, code: int) -> NoReturn:
    _discard_and_print(message)
    raise typer.Exit(code)


def _discard_and_print(message: str) -> None:
    """Flush standard output, or discard it, and print a message unless it is empty."""
    _flush_or_discard(sys.stdout)
    if message:
        with suppress(OSError):  # if standard error fails, only the exit code reports the error
            print_message(message)
    _flush_or_discard(sys.stderr)
