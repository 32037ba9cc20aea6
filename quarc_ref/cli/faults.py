"""Faults to sentences and exit codes.

0: done. 1: the stream is bad. 2: the command line is. 3: the tool could not do
its work: an unreadable capture, a full disk, an interruption.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

import typer

from quarc_ref.datasets.errors import CaptureError
from quarc_ref.format.errors import BitstreamError, QuarcError

STREAM_IS_BAD = 1
USAGE = 2
TOOL_FAILED = 3


class UsageError(Exception):
    """Options or paths that do not fit together."""


@contextmanager
def reported_faults() -> Iterator[None]:
    """Turn the faults of a command into a line on stderr and an exit code."""
    try:
        yield
    except BitstreamError as error:
        _leave(f"the stream is refused: {error}", STREAM_IS_BAD)
    except (UsageError, FileExistsError, FileNotFoundError, IsADirectoryError) as error:
        _leave(_sentence(error), USAGE)
    except (CaptureError, QuarcError, OSError, RuntimeError) as error:
        _leave(_sentence(error), TOOL_FAILED)
    except KeyboardInterrupt:
        _leave("interrupted; nothing was put in the place of the target", TOOL_FAILED)


def _sentence(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        place = f"{error.filename}: " if error.filename else ""
        return f"{place}{error.strerror}"
    return str(error)


def _leave(message: str, code: int) -> NoReturn:
    sys.stderr.write(f"quarc-ref: {message}\n")
    raise typer.Exit(code)
