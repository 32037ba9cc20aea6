"""Imports pycolmap, and restores the handler of SIGTERM that pycolmap replaces.

pycolmap's handler prints a stack trace and ends the process, so that nothing can be cleaned up.

PyPI has no wheel of pycolmap for some systems, such as Linux on ARM. There, captures in other
layouts than COLMAP's can be used if they contain initial points.
"""

import signal
import sys
import threading
from typing import TYPE_CHECKING, Any, NoReturn

_handler = signal.getsignal(signal.SIGTERM)
# A signal that arrives during the import waits for the restored handler.
if sys.platform != "win32":
    _mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])


class _MissingPycolmap:
    """Stands for pycolmap if it is not installed: using it raises ImportError."""

    def __getattr__(self, name: str) -> NoReturn:
        message = f"pycolmap.{name} is needed"
        raise ImportError(message, name="pycolmap")


if TYPE_CHECKING:
    import pycolmap
else:
    try:
        import pycolmap
    except ModuleNotFoundError:
        pycolmap: Any = _MissingPycolmap()
    finally:
        # Only the main thread can set a handler; None stands for one that Python did not install.
        if _handler is not None and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGTERM, _handler)
        if sys.platform != "win32":
            signal.pthread_sigmask(signal.SIG_SETMASK, _mask)

IS_INSTALLED = not isinstance(pycolmap, _MissingPycolmap)

__all__ = ["IS_INSTALLED", "pycolmap"]
