"""Imports pycolmap, and restores the handler of SIGTERM that pycolmap replaces.

pycolmap's handler prints a stack trace and ends the process, so that nothing can be cleaned up.
"""

import signal
import sys
import threading

_handler = signal.getsignal(signal.SIGTERM)
# A signal that arrives during the import waits for the restored handler.
if sys.platform != "win32":
    _mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])
try:
    import pycolmap
finally:
    # Only the main thread can set a handler; None stands for one that Python did not install.
    if _handler is not None and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _handler)
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_SETMASK, _mask)

__all__ = ["pycolmap"]
