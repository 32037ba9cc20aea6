"""Chooses the engine of a decoder or encoder."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib import import_module
from typing import Any

from quarc_ref.decoder.engine import FAST, REFERENCE, Engine
from quarc_ref.decoder.reference_engine import ReferenceEngine
from quarc_ref.format.errors import EnvironmentVariableError


def choose_engine(threads: int = 1) -> Engine[Any]:
    """Return the fast engine if it is installed, else the reference.

    The environment variable `QUARC_REF_ENGINE`, `reference` or `fast`, overrides the choice.

    Args:
        threads: Number of threads that the engine may use for one frame.

    Raises:
        EnvironmentVariableError: QUARC_REF_ENGINE names an unknown engine, or one that is
            not installed.
    """
    wanted = _engine.get() or os.environ.get("QUARC_REF_ENGINE")
    if wanted not in (None, "", REFERENCE, FAST):
        message = f"QUARC_REF_ENGINE is {wanted!r}; it must be {REFERENCE} or {FAST}"
        raise EnvironmentVariableError(message)
    fast = None if wanted == REFERENCE else find_fast_engine()
    if fast is None and wanted == FAST:
        message = "QUARC_REF_ENGINE is fast, but quarc_core is not installed: see core/README.md"
        raise EnvironmentVariableError(message)
    return fast(threads) if fast else ReferenceEngine()


@contextmanager
def use_engine(engine: str) -> Iterator[None]:
    """Use the named engine within this context."""
    token = _engine.set(engine)
    try:
        yield
    finally:
        _engine.reset(token)


@cache
def find_fast_engine() -> "Callable[[int], Engine[Any]] | None":
    """Return a function from a thread count to a fast engine; None if not installed."""
    try:
        module = import_module("quarc_ref.decoder.fast_engine")
    except ImportError:
        return None
    make: Callable[[int], Engine[Any]] = module.FastEngine
    return make


def misses_fast_engine() -> bool:
    """Whether this process has decoded a large scene without the fast engine installed."""
    return find_fast_engine() is None and ReferenceEngine.largest >= _LARGE


_LARGE = 1 << 13
_engine: ContextVar[str | None] = ContextVar("engine", default=None)
