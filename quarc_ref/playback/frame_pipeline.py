"""Decodes frames in advance for the `Player`.

The contexts of a frame's symbols depend on the previous state, so one thread decodes
frames sequentially. A second thread converts states to floats. An error is raised when
the frame that caused it is requested.
"""

import time
from collections import Counter
from collections.abc import Callable, Generator
from contextlib import closing
from dataclasses import dataclass
from typing import Any

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.decoder.engine import Engine, FrameState
from quarc_ref.decoder.engines import choose_engine
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.format.container import Chunk
from quarc_ref.playback.prefetcher import Prefetcher
from quarc_ref.streams.decode_stream import walk_frames
from quarc_ref.streams.source import Source

# Nanoseconds by stage: "decode" and "floats".
Times = Counter[str]

# Frames converted to floats in advance, including the one that is being converted. A frame takes
# about 150 bytes per Gaussian.
_PREFETCHED_FRAMES = 2


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A frame that is ready for rendering.

    Attributes:
        state: Decoded state.
        splats: Dequantized scene, which must not be modified.
        chunk_bytes: Size of the chunk's payload, bytes.
        nanoseconds: Time to decode the chunk and dequantize the state; the times of successive
            frames may overlap.
    """

    state: FrameState
    splats: Splats
    chunk_bytes: int
    nanoseconds: int

    @property
    def scene(self) -> Scene:
        """The scene in integers, which must not be modified."""
        return self.state.scene


# A closable iterator over frames.
Frames = Prefetcher[Frame] | Generator[Frame]


@dataclass(frozen=True, slots=True, eq=False)
class _DecodedFrame:
    """A decoded frame, which the first thread passes to the second."""

    state: FrameState
    chunk_bytes: int
    nanoseconds: int


@dataclass(frozen=True, slots=True, eq=False)
class FramePipeline:
    """Decodes the frames of a stream, in worker threads if there is more than one thread.

    The pipeline has no reference to the player, so an unused player can be garbage-collected.

    Attributes:
        source: The stream.
        threads: See `Player`.
        times: Counter of nanoseconds by stage; the time of every frame is added to it.
    """

    source: Source
    threads: int
    times: Times

    def make_frames(self, start: int, stop: int | None) -> Frames:
        """Return an iterator over the frames from `start` to `stop` - 1."""
        engine = choose_engine(self.threads)
        dequantize = engine.make_dequantizer()
        if self.threads == 1:
            return self._dequantize(self._decode(engine, start, stop), start, stop, dequantize)
        # A single frame is enough, because converted frames are buffered as well.
        decoded_frames = Prefetcher(lambda: self._decode(engine, start, stop), max_items=1)
        return Prefetcher(
            lambda: self._dequantize(decoded_frames, start, stop, dequantize), _PREFETCHED_FRAMES
        )

    def _decode(
        self, engine: Engine[Any], start: int, stop: int | None
    ) -> Generator[_DecodedFrame]:
        """Decode frames, beginning at the last seek point at or before `start`."""
        decoder = _TimedDecoder(engine)
        for chunk, state in walk_frames(self.source, decoder, start, stop):
            self.times["decode"] += decoder.nanoseconds
            yield _DecodedFrame(state, len(chunk.payload), decoder.nanoseconds)

    def _dequantize(
        self,
        decoded_frames: Generator[_DecodedFrame] | Prefetcher[_DecodedFrame],
        start: int,
        stop: int | None,
        dequantize: Callable[[FrameState], Splats],
    ) -> Generator[Frame]:
        """Dequantize the requested frames."""
        with closing(decoded_frames):
            for decoded in decoded_frames:
                frame = decoded.state.frame
                if frame < start or (stop is not None and frame >= stop):
                    continue
                start_ns = time.perf_counter_ns()
                splats = dequantize(decoded.state)
                elapsed_ns = time.perf_counter_ns() - start_ns
                self.times["floats"] += elapsed_ns
                yield Frame(
                    decoded.state, splats, decoded.chunk_bytes, decoded.nanoseconds + elapsed_ns
                )


class _TimedDecoder(StreamDecoder):
    """A decoder that measures decoding time, excluding the time spent waiting for the source."""

    nanoseconds = 0

    def push(self, chunk: Chunk) -> FrameState | None:
        """See `StreamDecoder.push`."""
        start_ns = time.perf_counter_ns()
        state = super().push(chunk)
        self.nanoseconds = time.perf_counter_ns() - start_ns
        return state
