"""Handlers of SIGINT (Ctrl-C) and SIGTERM.

While the command starts, a signal ends the process at once. When a command runs, it raises an
exception, so that cleanup code runs.
"""

import os
import signal
from types import FrameType
from typing import NoReturn

SIGNAL_BASE = 128


class Termination(KeyboardInterrupt):
    """Raised on SIGTERM: the command stops as after Ctrl-C, but with a different exit code."""


def exit_on_signals() -> None:
    """End the process without a traceback on a signal, until `raise_on_signals` is called.

    An ignored SIGINT stays ignored, as in a background job of a shell.
    """
    signal.signal(signal.SIGTERM, _exit)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _exit)


def raise_on_signals() -> None:
    """Raise KeyboardInterrupt or Termination on a signal, if `exit_on_signals` was called."""
    if signal.getsignal(signal.SIGTERM) is _exit:
        signal.signal(signal.SIGTERM, _raise_termination)
    if signal.getsignal(signal.SIGINT) is _exit:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _exit(number: int, _frame: FrameType | None) -> NoReturn:
    os._exit(SIGNAL_BASE + number)


def _raise_termination(_number: int, _frame: FrameType | None) -> NoReturn:
    raise Termination
