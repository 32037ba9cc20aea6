"""Decodes frames in advance for the `Player`.

The contexts of a frame's symbols depend on the previous state, so one thread decodes
frames sequentially. A second thread converts states to floats. Errors are raised in place
of the frame.
"""

import time
from collections import Counter
from collections.abc import Callable, Generator
from contextlib import closing
from dataclasses import dataclass, replace
from threading import Event
from typing import Any

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.decoder.engine import Engine, FrameState
from quarc_ref.decoder.engines import choose_engine
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.format.container import Chunk
from quarc_ref.playback.prefetcher import Prefetcher
from quarc_ref.streams.decode_stream import walk_frames
from quarc_ref.streams.follow import Follow
from quarc_ref.streams.source import Source

# Nanoseconds by stage.
Times = Counter[str]


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A frame that is ready for rendering.

    Attributes:
        state: Decoded state.
        splats: Dequantized scene, read-only.
        chunk_bytes: Size of the chunk's payload.
        nanoseconds: Decoding time of chunk and floats, which may overlap with neighboring frames.
    """

    state: FrameState
    splats: Splats
    chunk_bytes: int
    nanoseconds: int

    @property
    def scene(self) -> Scene:
        """Integer scene, which is immutable."""
        return self.state.scene


# Iterator over frames that can be closed.
Frames = Prefetcher[Frame] | Generator[Frame]


@dataclass(frozen=True, slots=True, eq=False)
class _Decoded:
    """A state that is passed from the first thread to the second."""

    state: FrameState
    chunk_bytes: int
    nanoseconds: int


@dataclass(frozen=True, slots=True, eq=False)
class FramePipeline:
    """Decodes the frames of a stream in worker threads; holds no reference to the player.

    Attributes:
        source: The stream.
        threads: See `Player`.
        prefetch: See `Player`.
        follow: See `Player`.
        times: Counter to which nanoseconds by stage are added.
    """

    source: Source
    threads: int
    prefetch: int
    follow: Follow | None
    times: Times

    def make(self, start: int, stop: int | None) -> Frames:
        """Return an iterator over the frames from `start` to `stop` - 1."""
        engine = choose_engine(self.threads)
        if self.threads == 1:
            states = self._decode(engine, start, stop, self.follow)
            return self._finish(states, start, stop, engine.dequantizer())
        closed = Event()
        follow = self.follow and replace(self.follow, stop_event=closed)
        dequantize = engine.dequantizer()
        decoded = Prefetcher(lambda: self._decode(engine, start, stop, follow), self.prefetch)
        return Prefetcher(
            lambda: self._finish(decoded, start, stop, dequantize), self.prefetch, closed=closed
        )

    def _decode(
        self, engine: Engine[Any], start: int, stop: int | None, follow: Follow | None
    ) -> Generator[_Decoded]:
        """Decode frames, possibly starting before `start`."""
        decoder = _TimedDecoder(engine)
        for chunk, state in walk_frames(self.source, decoder, start, stop, follow):
            self.times["decode"] += decoder.nanoseconds
            yield _Decoded(state, len(chunk.payload), decoder.nanoseconds)

    def _finish(
        self,
        decoded: Generator[_Decoded] | Prefetcher[_Decoded],
        start: int,
        stop: int | None,
        dequantize: Callable[[FrameState], Splats],
    ) -> Generator[Frame]:
        """Convert the requested frames to floats."""
        with closing(decoded):
            for each in decoded:
                frame = each.state.frame
                if frame < start or (stop is not None and frame >= stop):
                    continue
                started = time.perf_counter_ns()
                splats = dequantize(each.state)
                spent = time.perf_counter_ns() - started
                self.times["floats"] += spent
                yield Frame(each.state, splats, each.chunk_bytes, each.nanoseconds + spent)


class _TimedDecoder(StreamDecoder):
    """Measures the time of the last chunk, without waits for its source."""

    nanoseconds = 0

    def push(self, chunk: Chunk) -> FrameState | None:
        """See `StreamDecoder.push`."""
        started = time.perf_counter_ns()
        state = super().push(chunk)
        self.nanoseconds = time.perf_counter_ns() - started
        return state
