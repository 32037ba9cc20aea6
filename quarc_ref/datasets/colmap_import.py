"""Imports pycolmap, and restores the handler of SIGTERM that pycolmap replaces.

pycolmap's handler prints a stack trace and ends the process, so that nothing can be cleaned up.
"""

import signal
import threading

_handler = signal.getsignal(signal.SIGTERM)

import pycolmap  # noqa: E402

# Only the main thread can set a handler; None stands for a handler that Python did not install.
if _handler is not None and threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGTERM, _handler)

__all__ = ["pycolmap"]
