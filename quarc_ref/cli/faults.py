"""Faults to sentences and exit codes.

0: done. 1: the stream is bad. 2: the command line is. 3: the tool could not do
its work: an unreadable capture, a full disk, an interruption, a fault of ours.
"""

import os
import signal
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import NoReturn, TextIO

import typer

from quarc_ref.cli.output import escape_controls
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.format.errors import (
    BitstreamError,
    EditError,
    QuarcError,
    ResumeError,
    VariableError,
)

STREAM_IS_BAD = 1
USAGE = 2
TOOL_FAILED = 3
_EXTRAS = {"gsplat": "gpu", "ray": "ray", "viser": "view"}
_NOTHING_LEFT = "interrupted; nothing is left behind"


class UsageError(Exception):
    """Options or paths that do not fit together."""


@contextmanager
def reported_faults() -> Iterator[None]:
    """Turn the faults of a command into a line on stderr and an exit code."""
    try:
        yield
        sys.stdout.flush()  # Python itself would find out too late, and leave with 120
    except typer.Exit:
        _let_go_of(sys.stdout)
        raise
    except BitstreamError as error:
        _leave(f"the stream is refused: {error}", STREAM_IS_BAD)
    except (UsageError, EditError, ResumeError, VariableError) as error:
        _leave(str(error), USAGE)
    except ImportError as error:
        _leave(_name_extra(error), TOOL_FAILED)
    except KeyboardInterrupt as error:
        _leave(str(error) or _NOTHING_LEFT, TOOL_FAILED)
    except (CaptureError, QuarcError, OSError, RuntimeError, MemoryError) as error:
        _leave(_sentence(error), TOOL_FAILED)
    except Exception as error:  # Python's own code for it, 1, would blame the stream
        traceback.print_exc()
        _leave(f"a fault of this program: {error!r}", TOOL_FAILED)


def heed_termination() -> None:
    """End on SIGTERM as on Ctrl-C: with nothing left behind."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)


def regain_signals() -> None:
    """Take SIGTERM back from pycolmap, which takes it for itself when it is imported."""
    signal.signal(signal.SIGTERM, signal.getsignal(signal.SIGTERM))


def provide_outputs() -> None:
    """Let there be a standard output and error, for nobody, where they were closed."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115, for good


def _let_go_of(output: TextIO) -> None:
    """Keep Python from trying again, when it ends, to write what cannot be written."""
    try:
        output.flush()
    except OSError:
        with suppress(OSError):  # where it is no file at all
            os.dup2(os.open(os.devnull, os.O_WRONLY), output.fileno())


def _sentence(error: Exception) -> str:
    if isinstance(error, BrokenPipeError):
        return "standard output was closed by its reader"
    if isinstance(error, MemoryError):
        return f"there is not enough memory: {error}" if str(error) else "out of memory"
    if isinstance(error, OSError) and error.strerror:
        place = f"{error.filename}: " if error.filename else ""
        return f"{place}{error.strerror}"
    return str(error) or repr(error)


def _name_extra(error: ImportError) -> str:
    extra = _EXTRAS.get(error.name or "", "encode")
    return f"{error.name or error} cannot be imported: pip install 'quarc-ref[{extra}]' brings it"


def _leave(message: str, code: int) -> NoReturn:
    _let_go_of(sys.stdout)
    with suppress(OSError):  # the code is left to tell
        sys.stderr.write(f"quarc-ref: {escape_controls(message)}\n")
    _let_go_of(sys.stderr)
    raise typer.Exit(code)
