"""Defers Ctrl-C and SIGTERM to the end of a training step."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def defer_signals() -> Iterator[None]:
    """Defer SIGINT and SIGTERM signals that arrive within this context until it ends.

    A signal without a Python handler is not deferred. In threads other than the main thread,
    the context has no effect, because only the main thread runs signal handlers.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received_signals: list[int] = []
    handlers = {
        signal_number: handler
        for signal_number in _SIGNALS
        if callable(handler := signal.getsignal(signal_number))
    }
    for signal_number in handlers:
        signal.signal(
            signal_number, lambda signal_number, _frame: received_signals.append(signal_number)
        )
    try:
        yield
    finally:
        for signal_number, handler in handlers.items():
            signal.signal(signal_number, handler)
    if received_signals:
        signal.raise_signal(received_signals[0])
