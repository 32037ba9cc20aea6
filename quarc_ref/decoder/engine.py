"""Who computes the states: a boundary at the height of the state.

What a state is, SPEC says and the reference engine shows: `frames` and what it
calls, values in plain NumPy. A fast engine computes the same integers by other
means. It is held to the reference by the conformance suite and by tests that
run both; nothing but time depends on the choice.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib import import_module
from typing import Any, Final, Protocol, TypeVar

from quarc_ref.decoder import frames, reconstruct
from quarc_ref.decoder.anchors import Anchors
from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.dequantize import Splats, dequantize
from quarc_ref.decoder.digest import state_crc
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.state import State
from quarc_ref.decoder.updates import update_context
from quarc_ref.format.arrays import Int16, Int64
from quarc_ref.format.errors import VariableError
from quarc_ref.format.gaussian_planes import write_births, write_canonical
from quarc_ref.format.motion_planes import write_motion
from quarc_ref.format.records import (
    Births,
    CanonicalChunk,
    FrameChunk,
    Gaussians,
    Section,
    SnapshotChunk,
    StreamHeader,
)
from quarc_ref.format.update_planes import write_updates
from quarc_ref.format.updates import Updates

REFERENCE: Final = "reference"
FAST: Final = "fast"


class FrameState(Protocol):
    """What is known of a frame above the boundary; see `state.State`."""

    @property
    def frame(self) -> int:
        """Ordinal of the frame in the stream."""
        ...

    @property
    def scene(self) -> Scene:
        """The frame's scene."""
        ...

    @property
    def motion(self) -> Int16:
        """`[c, N]` what moved each Gaussian in the frame."""
        ...

    @property
    def symbols(self) -> tuple[Int64, ...]:
        """`[c, a]` of each level's anchors, level 1 first; nothing in a canonical frame."""
        ...

    @property
    def births(self) -> Births | None:
        """The newborn of the frame, as coded."""
        ...

    @property
    def updates(self) -> Updates | None:
        """What changed single Gaussians in the frame, as coded."""
        ...

    @property
    def next_id(self) -> int:
        """The id that the next newborn gets."""
        ...

    @property
    def anchors(self) -> Anchors | None:
        """The anchors of the last sampling; None before the first."""
        ...

    @property
    def known_anchors(self) -> Anchors:
        """The anchors of a state that has been through `begin_frame`."""
        ...


StateT = TypeVar("StateT", bound=FrameState)


class Engine(Protocol[StateT]):
    """What makes states of what is coded, and codes what an encoder chose.

    A state belongs to the engine that made it. Every method raises what the
    function of the same name raises in the reference.
    """

    name: str

    def decode_canonical(
        self, header: StreamHeader, chunk: CanonicalChunk
    ) -> tuple[StateT, Gaussians]:
        """See `frames.decode_canonical`."""
        ...

    def decode_snapshot(
        self, header: StreamHeader, chunk: SnapshotChunk, canonical: Gaussians
    ) -> tuple[StateT, Int64]:
        """See `frames.decode_snapshot`."""
        ...

    def decode_frame(self, state: StateT, chunk: FrameChunk) -> StateT:
        """See `frames.decode_frame`."""
        ...

    def begin_canonical(self, header: StreamHeader, frame: int, gaussians: Gaussians) -> StateT:
        """See `canonical.begin_canonical`."""
        ...

    def begin_frame(self, state: StateT, death_count: int) -> StateT:
        """See `reconstruct.begin_frame`."""
        ...

    def decode_motion(self, state: StateT, section: Section, *, previous: bool) -> StateT:
        """See `frames.decode_motion`."""
        ...

    def decode_updates(self, state: StateT, section: Section) -> StateT:
        """See `frames.decode_updates`."""
        ...

    def decode_births(self, state: StateT, section: Section, count: int) -> StateT:
        """See `frames.decode_births`."""
        ...

    def write_canonical(
        self, gaussians: Gaussians, origin: tuple[int, int, int]
    ) -> tuple[Section, ...]:
        """See `gaussian_planes.write_canonical`."""
        ...

    def write_motion(self, state: StateT, symbols: list[Int64], *, previous: bool) -> Section:
        """Code the symbols of a frame that has begun; see `motion_planes.write_motion`."""
        ...

    def write_updates(self, state: StateT, updates: Updates) -> Section:
        """Code the updates of a frame that has moved; see `update_planes.write_updates`."""
        ...

    def write_births(self, state: StateT, births: Births) -> Section:
        """Code the births of a frame that has moved; see `gaussian_planes.write_births`."""
        ...

    def state_crc(self, state: StateT) -> int:
        """Return the CRC of a state's scene; see `digest.state_crc`."""
        ...

    def dequantizer(self) -> Callable[[StateT], Splats]:
        """Return what does as `dequantize.dequantize` for the states of a stream."""
        ...


class ReferenceEngine:
    """The text, as it stands in `frames` and what it calls; see `Engine`."""

    name = REFERENCE
    decode_snapshot = staticmethod(frames.decode_snapshot)
    decode_frame = staticmethod(frames.decode_frame)
    begin_canonical = staticmethod(begin_canonical)
    begin_frame = staticmethod(reconstruct.begin_frame)
    decode_motion = staticmethod(frames.decode_motion)
    decode_updates = staticmethod(frames.decode_updates)
    decode_births = staticmethod(frames.decode_births)
    write_canonical = staticmethod(write_canonical)

    def decode_canonical(
        self, header: StreamHeader, chunk: CanonicalChunk
    ) -> tuple[State, Gaussians]:
        """See `Engine.decode_canonical`."""
        if chunk.gaussian_count >= _LARGE and find_fast_engine() is None:
            _missed.add(FAST)
        return frames.decode_canonical(header, chunk)

    def write_motion(self, state: State, symbols: list[Int64], *, previous: bool) -> Section:
        """See `Engine.write_motion`."""
        contexts = reconstruct.motion_contexts(state, previous=previous)
        return write_motion(contexts, symbols, state.motion_counts)

    def write_updates(self, state: State, updates: Updates) -> Section:
        """See `Engine.write_updates`."""
        return write_updates(update_context(state), updates, state.update_counts)

    def write_births(self, state: State, births: Births) -> Section:
        """See `Engine.write_births`."""
        return write_births(births, state.birth_counts)

    def state_crc(self, state: State) -> int:
        """See `Engine.state_crc`."""
        return state_crc(state.scene)

    def dequantizer(self) -> Callable[[State], Splats]:
        """See `Engine.dequantizer`."""
        return lambda state: dequantize(state.scene)


def choose_engine(threads: int = 1) -> Engine[Any]:
    """Return the fast engine where it is installed, else the reference.

    `QUARC_REF_ENGINE` says otherwise: `reference` or `fast`.

    Args:
        threads: How many the engine may take for one frame.

    Raises:
        VariableError: QUARC_REF_ENGINE names no engine, or one that is not installed.
    """
    wanted = _engine.get() or os.environ.get("QUARC_REF_ENGINE")
    if wanted not in (None, "", REFERENCE, FAST):
        message = f"QUARC_REF_ENGINE is {wanted!r}; it may be {REFERENCE} or {FAST}"
        raise VariableError(message)
    fast = None if wanted == REFERENCE else find_fast_engine()
    if fast is None and wanted == FAST:
        message = "QUARC_REF_ENGINE is fast, and quarc_core is not installed: see core/README.md"
        raise VariableError(message)
    return fast(threads) if fast else ReferenceEngine()


@contextmanager
def decoding_by(engine: str) -> Iterator[None]:
    """Use the engine of this name, as long as this context lasts."""
    token = _engine.set(engine)
    try:
        yield
    finally:
        _engine.reset(token)


@cache
def find_fast_engine() -> "Callable[[int], Engine[Any]] | None":
    """Return what makes a fast engine of so many threads; None where it is not installed."""
    try:
        module = import_module("quarc_ref.decoder.fast_engine")
    except ImportError:
        return None
    make: Callable[[int], Engine[Any]] = module.FastEngine
    return make


def misses_fast_engine() -> bool:
    """Tell whether this process has decoded a large scene without a fast engine to be had."""
    return bool(_missed)


_LARGE = 1 << 13
_missed: set[str] = set()
_engine: ContextVar[str | None] = ContextVar("engine", default=None)
