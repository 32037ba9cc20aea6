"""A stream that plays: frames decoded ahead of whoever draws them.

    with Player(source) as player:
        for frame in player:
            draw(frame.splats)

What a frame's symbols mean hangs on the state before it: the contexts of its
motion on how each Gaussian moved, the parents of its newborn on the scene. So
the reconstruction of a frame cannot begin before that of the frame before it
has ended, and one thread does both, entropy decoding and reconstruction, frame
after frame. What nothing waits for, a second thread does meanwhile: it holds
each state against its CRC and makes the floats. Within the first thread, the
deaths, the binding, the motion and the sections of a canonical frame are cut in
parts for as many threads as there may be. What the next step does not read is
done meanwhile: the newborn are read, rotations and codes lose the dead, and
level 1 is bound, while the coarser levels are, and while symbols are decoded.

No frame is given out before its CRC has been held against it, nor after a
frame that was refused: faults come out where the frame would have.
"""

import time
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass
from types import TracebackType
from typing import TypeVar

from quarc_ref.decoder.ahead import Ahead
from quarc_ref.decoder.decode_stream import StreamDecoder, walk_frames
from quarc_ref.decoder.dequantize import Dequantizer, Splats
from quarc_ref.decoder.follow import Follow
from quarc_ref.decoder.frames import prove_state
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.stopwatch import Times, stage, timing_into
from quarc_ref.format.acceleration import threading_by
from quarc_ref.format.errors import BitstreamError
from quarc_ref.format.source import Source, as_source

_Item = TypeVar("_Item")


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A frame that is ready to be drawn.

    Attributes:
        scene: Its integers, which stay as they are.
        splats: Its floats. Their arrays are overwritten once the next frame
            is asked for: copy what must last longer.
        chunk_bytes: Of the chunk's payload.
        nanoseconds: What decoding it took, of all threads together.
    """

    scene: Scene
    splats: Splats
    chunk_bytes: int
    nanoseconds: int


@dataclass(frozen=True, slots=True, eq=False)
class _Decoded:
    """A state on its way from the first thread to the second."""

    scene: Scene
    state_crc: int
    offset: int
    chunk_bytes: int
    nanoseconds: int


class Player:
    """Plays the frames of a stream. One run at a time: a new one ends the one before.

    Args:
        stream: A stream; it is the caller's to close, after the player.
        threads: 1 to decode a frame when it is asked for and no sooner; 2 or
            more to decode ahead, each piece of work cut for so many threads,
            where there are Gaussians enough.
        ahead: How many frames may wait to be taken, at least 1. Memory is
            bounded by it: a frame that waits takes about 200 bytes a Gaussian.
        follow: How long to wait for a stream that still grows; None not to.

    Attributes:
        times: Nanoseconds by stage, of all frames so far.
    """

    def __init__(
        self,
        stream: bytes | Source,
        *,
        threads: int = 2,
        ahead: int = 2,
        follow: Follow | None = None,
    ) -> None:
        self.times = Times()
        self._source = as_source(stream)
        self._threads = threads
        self._ahead = ahead
        self._follow = follow
        self._run: Ahead[Frame] | Generator[Frame] | None = None
        self._due = -1  # of the run of `frame`: the ordinal of what comes next

    def __enter__(self) -> "Player":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __iter__(self) -> Iterator[Frame]:
        return self.frames()

    def close(self) -> None:
        """End what runs; the player can be used again."""
        if self._run is not None:
            self._run.close()
        self._run, self._due = None, -1

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        """Play from a frame on, found through the stream's seek points.

        Args:
            start: Ordinal of the first frame wanted.
            stop: Ordinal after the last one; None for all.

        Yields:
            The frames in order.

        Raises:
            BitstreamError: What is wrong with the bytes; every frame before
                the fault has been given out.
            SourceError: What holds the stream does not give its bytes.
        """
        self.close()
        run = self._run = self._begin(start, stop)
        return run

    def frame(self, ordinal: int) -> Frame:
        """Return one frame. The frames that follow it are decoded ahead.

        Raises:
            LookupError: The stream has no such frame.
            BitstreamError: As for `frames`.
            SourceError: As for `frames`.
        """
        if self._due < 0 or not self._due <= ordinal <= self._due + self._ahead:
            self.frames(ordinal)
        while self._run is not None and (frame := next(self._run, None)) is not None:
            self._due = frame.scene.frame + 1
            if frame.scene.frame >= ordinal:
                break
        else:
            frame = None
        if frame is not None and frame.scene.frame == ordinal:
            return frame
        message = f"the stream has no frame {ordinal}"
        raise LookupError(message)

    def play(
        self, show: Callable[[Frame], object], start: int = 0, stop: int | None = None
    ) -> None:
        """Call a function with every frame, in order, in the thread of the caller.

        Raises:
            BitstreamError: As for `frames`.
            SourceError: As for `frames`.
        """
        for frame in self.frames(start, stop):
            show(frame)

    def _begin(self, start: int, stop: int | None) -> "Ahead[Frame] | Generator[Frame]":
        if self._threads <= 1:
            dequantize = Dequantizer(1)
            return self._in_turn(self._finish(self._decode(start, stop), start, stop, dequantize))
        dequantize = Dequantizer(self._ahead + 3)
        # Both threads have kernels to load; the first frame does not wait for those of the second.
        decoded = Ahead(
            lambda: self._in_turn(self._decode(start, stop)), self._ahead, first_alone=True
        )
        return Ahead(
            lambda: self._in_turn(self._finish(decoded, start, stop, dequantize)), self._ahead
        )

    def _in_turn(self, items: Generator[_Item]) -> Generator[_Item]:
        """Yield items, each made under this player's settings, which do not leak to others."""
        with closing(items):
            while True:
                with timing_into(self.times), threading_by(self._threads):
                    item = next(items, None)
                if item is None:
                    return
                yield item

    def _decode(self, start: int, stop: int | None) -> Generator[_Decoded]:
        """Decode frames, the first of them before `start` maybe; their CRCs are not looked at."""
        stated: list[int] = []
        decoder = StreamDecoder(lambda _scene, state_crc: stated.append(state_crc))
        begun = time.perf_counter_ns()
        for chunk, state in walk_frames(self._source, decoder, start, stop, self._follow):
            spent = time.perf_counter_ns() - begun
            size = len(chunk.payload)
            yield _Decoded(state.scene, stated.pop(), chunk.offset, size, spent)
            begun = time.perf_counter_ns()

    def _finish(
        self,
        decoded: Generator[_Decoded] | Ahead[_Decoded],
        start: int,
        stop: int | None,
        dequantize: Dequantizer,
    ) -> Generator[Frame]:
        """Prove states and make floats of those that are wanted."""
        with closing(decoded):
            for each in decoded:
                begun = time.perf_counter_ns()
                self._prove(each)
                if each.scene.frame < start or (stop is not None and each.scene.frame >= stop):
                    continue
                with stage("floats"):
                    splats = dequantize(each.scene)
                spent = each.nanoseconds + time.perf_counter_ns() - begun
                yield Frame(each.scene, splats, each.chunk_bytes, spent)

    def _prove(self, decoded: _Decoded) -> None:
        try:
            prove_state(decoded.scene, decoded.state_crc)
        except BitstreamError as error:
            error.offset = decoded.offset
            raise
