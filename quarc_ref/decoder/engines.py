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

MAX_THREADS = 64


def choose_engine(threads: int = 1) -> Engine[Any]:
    """Return the fast engine if it is installed in the right version, else the reference engine.

    The environment variable `QUARC_REF_ENGINE` (`reference` or `fast`) overrides this choice.

    Args:
        threads: Number of threads that the engine may use for one frame; more than MAX_THREADS are
            not started.

    Raises:
        EnvironmentVariableError: QUARC_REF_ENGINE names an unknown engine, or one that is
            not installed in the right version.
        ValueError: `threads` is below 1.
    """
    if threads < 1:
        message = f"threads ({threads}) must be at least 1"
        raise ValueError(message)
    engine_name = _engine.get() or os.environ.get("QUARC_REF_ENGINE")
    if engine_name not in (None, "", REFERENCE, FAST):
        message = f"QUARC_REF_ENGINE is {engine_name!r}; it must be {REFERENCE} or {FAST}"
        raise EnvironmentVariableError(message)
    make_fast_engine = None if engine_name == REFERENCE else find_fast_engine()
    if make_fast_engine is None and engine_name == FAST:
        message = f"QUARC_REF_ENGINE is 'fast', but {explain_missing()}: see core/README.md"
        raise EnvironmentVariableError(message)
    return make_fast_engine(min(threads, MAX_THREADS)) if make_fast_engine else ReferenceEngine()


@contextmanager
def use_engine(engine_name: str) -> Iterator[None]:
    """Make `choose_engine` return the named engine, `reference` or `fast`, in a `with` block."""
    token = _engine.set(engine_name)
    try:
        yield
    finally:
        _engine.reset(token)


@cache
def find_fast_engine() -> "Callable[[int], Engine[Any]] | None":
    """Return the function that makes a fast engine; None if there is no usable one."""
    try:
        module = import_module(_FAST_ENGINE_MODULE)
    except ImportError:
        return None
    make_engine: Callable[[int], Engine[Any]] = module.FastEngine
    return make_engine


def explain_missing() -> str:
    """Return why there is no fast engine: quarc_core may be of another version or Python."""
    try:
        import_module(_FAST_ENGINE_MODULE)
    except ImportError as error:
        if not isinstance(error, ModuleNotFoundError):
            return f"quarc_core cannot be used ({error})"
    return "quarc_core is not installed"


def would_benefit_from_fast_engine() -> bool:
    """Return whether there is no fast engine and this process has decoded a large scene."""
    return (
        find_fast_engine() is None
        and ReferenceEngine.largest_gaussian_count >= _LARGE_SCENE_GAUSSIAN_COUNT
    )


_FAST_ENGINE_MODULE = "quarc_ref.decoder.fast_engine"
_LARGE_SCENE_GAUSSIAN_COUNT = 1 << 13
_engine: ContextVar[str | None] = ContextVar("engine", default=None)
