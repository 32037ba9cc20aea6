"""The fast engine: `quarc_core`, an extension written in Rust.

Its results equal those of the reference engine; Python and Rust share arrays without copies.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache

import numpy as np
import quarc_core

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.decoder.engine import FAST
from quarc_ref.decoder.fast_state import FastState
from quarc_ref.format import wire
from quarc_ref.format.arrays import Int64, UInt32
from quarc_ref.format.errors import BitstreamError, EncodeError, LimitError
from quarc_ref.format.records import (
    Births,
    CanonicalChunk,
    FrameChunk,
    Gaussians,
    Section,
    SnapshotChunk,
    StreamHeader,
)
from quarc_ref.format.updates import Updates

CORE_VERSION = "1.1.0"  # of core/Cargo.toml

if (_version := getattr(quarc_core, "__version__", None)) != CORE_VERSION:
    _message = f"its version is {_version}, but this quarc-ref needs version {CORE_VERSION}"
    raise ImportError(_message, name="quarc_core")


class FastEngine:
    """The Rust core as an engine; see `engine.Engine`.

    Args:
        threads: Number of threads that the core may use for one frame.
    """

    name = FAST

    def __init__(self, threads: int = 1) -> None:
        workers = quarc_core.Workers(threads)

        @lru_cache(maxsize=8)
        def make_head(header: StreamHeader) -> quarc_core.StreamHead:
            return quarc_core.StreamHead(wire.build_stream_header(header), workers)

        self._make_head = make_head

    def decode_canonical(
        self, header: StreamHeader, chunk: CanonicalChunk
    ) -> tuple[FastState, Gaussians]:
        """See `Engine.decode_canonical`; the Gaussians are empty in streams without snapshots."""
        with _convert_errors():
            core, coded = quarc_core.State.decode_canonical(
                self._make_head(header),
                chunk.frame,
                chunk.gaussian_count,
                chunk.origin,
                chunk.axis_bits,
                [_aligned_words(section) for section in chunk.sections],
                chunk.state_crc,
                header.snapshots,
            )
        return FastState(header, core), Gaussians(*(coded or _NO_GAUSSIANS))

    def decode_snapshot(
        self, header: StreamHeader, chunk: SnapshotChunk, canonical: Gaussians
    ) -> tuple[FastState, Int64]:
        """See `Engine.decode_snapshot`."""
        with _convert_errors():
            core, canonical_indices = quarc_core.State.decode_snapshot(
                self._make_head(header),
                (chunk.frame, chunk.canonical),
                chunk.newborn_count,
                chunk.origin,
                chunk.axis_bits,
                _aligned_words(chunk.survivors),
                [_aligned_words(section) for section in chunk.sections],
                chunk.state_crc,
                _arrays_of(canonical),
            )
        return FastState(header, core), canonical_indices

    def decode_frame(self, state: FastState, chunk: FrameChunk) -> FastState:
        """See `Engine.decode_frame`."""
        with _convert_errors():
            core = state.core.decode_frame(
                chunk.phase,
                chunk.previous_contexts,
                chunk.death_count,
                chunk.birth_count,
                _aligned_words(chunk.motion),
                None if chunk.updates is None else _aligned_words(chunk.updates),
                _aligned_words(chunk.births),
                chunk.state_crc,
            )
        return FastState(state.header, core)

    def begin_canonical(self, header: StreamHeader, frame: int, gaussians: Gaussians) -> FastState:
        """See `Engine.begin_canonical`."""
        with _convert_errors():
            core = quarc_core.State.begin_canonical(
                self._make_head(header), frame, _arrays_of(gaussians)
            )
        return FastState(header, core)

    def begin_frame(self, state: FastState, death_count: int) -> FastState:
        """See `Engine.begin_frame`."""
        with _convert_errors():
            return FastState(state.header, state.core.begin_frame(death_count))

    def decode_motion(self, state: FastState, section: Section, *, use_previous: bool) -> FastState:
        """See `Engine.decode_motion`."""
        with _convert_errors():
            return FastState(
                state.header, state.core.decode_motion(_aligned_words(section), use_previous)
            )

    def decode_updates(self, state: FastState, section: Section) -> FastState:
        """See `Engine.decode_updates`."""
        with _convert_errors():
            return FastState(state.header, state.core.decode_updates(_aligned_words(section)))

    def decode_births(self, state: FastState, section: Section, count: int) -> FastState:
        """See `Engine.decode_births`."""
        with _convert_errors():
            return FastState(state.header, state.core.decode_births(_aligned_words(section), count))

    def write_canonical(
        self, gaussians: Gaussians, origin: tuple[int, int, int]
    ) -> tuple[Section, ...]:
        """See `Engine.write_canonical`."""
        with _convert_errors():
            sections = quarc_core.write_canonical(_arrays_of(gaussians), origin)
        return tuple(Section(words) for words in sections)

    def write_motion(
        self, state: FastState, symbols: list[Int64], *, use_previous: bool
    ) -> Section:
        """See `Engine.write_motion`."""
        with _convert_errors():
            return Section(state.core.write_motion(symbols, use_previous))

    def write_updates(self, state: FastState, updates: Updates) -> Section:
        """See `Engine.write_updates`."""
        with _convert_errors():
            words = state.core.write_updates(updates.gaussians, updates.dies, updates.residuals)
        return Section(words)

    def write_births(self, state: FastState, births: Births) -> Section:
        """See `Engine.write_births`."""
        with _convert_errors():
            return Section(state.core.write_births(births.parents, _arrays_of(births.newborn)))

    def state_crc(self, state: FastState) -> int:
        """See `Engine.state_crc`."""
        return state.core.state_crc()

    def make_dequantizer(self) -> Callable[[FastState], Splats]:
        """See `Engine.make_dequantizer`; the arrays are read-only."""
        core = quarc_core.Dequantizer()
        return lambda state: Splats(*core.dequantize(state.core))


@contextmanager
def _convert_errors() -> Iterator[None]:
    """Convert errors of the core to errors of this package.

    Raises:
        BitstreamError: The bytes are not a valid stream.
        LimitError: The stream exceeds the limits of this decoder.
        EncodeError: A scene cannot be represented in a stream.
    """
    try:
        yield
    except quarc_core.RejectedError as error:
        reject_id, message = error.args
        raise _ERRORS_BY_ID[reject_id](message) from error
    except quarc_core.DeclinedError as error:
        raise LimitError(str(error)) from error
    except quarc_core.UnwritableError as error:
        raise EncodeError(str(error)) from error


def _aligned_words(section: Section) -> UInt32:
    """Return the words of a section in aligned memory; those of a chunk may be unaligned."""
    return np.require(section.words, np.uint32, "A")


def _arrays_of(gaussians: Gaussians) -> tuple[Int64, Int64, Int64]:
    return gaussians.positions, gaussians.rotations, gaussians.codes


def _leaf_errors(error_class: type[BitstreamError]) -> Iterator[type[BitstreamError]]:
    subclasses = error_class.__subclasses__()
    yield from [leaf for subclass in subclasses for leaf in _leaf_errors(subclass)] or [error_class]


_ERRORS_BY_ID = {leaf.reject_id: leaf for leaf in _leaf_errors(BitstreamError)}
_NO_GAUSSIANS = tuple(np.zeros((rows, 0), dtype=np.int64) for rows in (3, 4, 16))
