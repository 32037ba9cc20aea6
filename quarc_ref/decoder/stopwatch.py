"""Where the time goes: nanoseconds by stage of decoding, for whoever asks."""

import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Times = Counter[str]


@contextmanager
def timing_into(times: Times) -> Iterator[None]:
    """Add what each stage takes to `times`, as long as this context lasts."""
    token = _times.set(times)
    try:
        yield
    finally:
        _times.reset(token)


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Take the time of what is done in this context, which no other stage is part of."""
    times = _times.get()
    if times is None:
        yield
        return
    begun = time.perf_counter_ns()
    try:
        yield
    finally:
        times[name] += time.perf_counter_ns() - begun


_times: ContextVar[Times | None] = ContextVar("times", default=None)
