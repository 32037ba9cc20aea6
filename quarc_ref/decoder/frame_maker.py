"""How frames are decoded ahead, for the `Player`.

What a frame's symbols mean hangs on the state before it: the contexts of its
motion on how each Gaussian moved, the parents of its newborn on the scene. So
the reconstruction of a frame cannot begin before that of the frame before it
has ended, and one thread does both, entropy decoding and reconstruction, frame
after frame. What nothing waits for, a second thread does meanwhile: it holds
each state against its CRC and makes the floats. Within the first thread, the
binding, the motion and the sections of a canonical frame are cut in parts for
as many threads as there may be. What the next step does not read is done
meanwhile: the newborn are read, rotations and codes lose the dead, and level 1
is bound, while the coarser levels are, and while symbols are decoded.

No frame is given out before its CRC has been held against it, nor after a
frame that was refused: faults come out where the frame would have.
"""

import time
from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass, replace
from threading import Event
from typing import TypeVar

from quarc_ref.decoder.ahead import Ahead
from quarc_ref.decoder.decode_stream import StreamDecoder, walk_frames
from quarc_ref.decoder.dequantize import Dequantizer, Splats
from quarc_ref.decoder.follow import Follow
from quarc_ref.decoder.frames import prove_state
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.state import State
from quarc_ref.decoder.stopwatch import Times, stage, timing_into
from quarc_ref.format.acceleration import threading_by
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import BitstreamError
from quarc_ref.format.source import Source

_Item = TypeVar("_Item")


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A frame that is ready to be drawn.

    Attributes:
        scene: Its integers, which stay as they are.
        splats: Its floats. Their arrays are overwritten once the next frame
            is asked for: copy what must last longer.
        chunk_bytes: Of the chunk's payload.
        nanoseconds: How long it took to decode: the times that its chunk and
            its floats took, which for frames after one another may overlap.
    """

    scene: Scene
    splats: Splats
    chunk_bytes: int
    nanoseconds: int


# What gives frames in order, and can be closed.
Frames = Ahead[Frame] | Generator[Frame]


@dataclass(frozen=True, slots=True, eq=False)
class _Decoded:
    """A state on its way from the first thread to the second."""

    scene: Scene
    state_crc: int
    offset: int
    chunk_bytes: int
    nanoseconds: int


@dataclass(frozen=True, slots=True, eq=False)
class FrameMaker:
    """Makes the frames of a stream; the threads at it hold this, and no player.

    Attributes:
        source: The stream.
        threads: As for `Player`.
        ahead: The same.
        follow: The same.
        times: Nanoseconds by stage are added to these.
    """

    source: Source
    threads: int
    ahead: int
    follow: Follow | None
    times: Times

    def make(self, start: int, stop: int | None) -> Frames:
        """Return what makes the frames from `start` up to, and without, `stop`."""
        if self.threads == 1:
            states = self._decode(start, stop, self.follow)
            return self._in_turn(self._finish(states, start, stop, Dequantizer(1)))
        closed = Event()
        follow = self.follow and replace(self.follow, ended=closed)
        # One set of floats is with whoever draws, one is being written, the others wait.
        dequantize = Dequantizer(self.ahead + 2)
        # Both threads have kernels to load; the first frame does not wait for those of the second.
        decoded = Ahead(
            lambda: self._in_turn(self._decode(start, stop, follow)),
            self.ahead,
            first_alone=True,
        )
        return Ahead(
            lambda: self._in_turn(self._finish(decoded, start, stop, dequantize)),
            self.ahead,
            closed=closed,
        )

    def _in_turn(self, items: Generator[_Item]) -> Generator[_Item]:
        """Yield items, each made under these settings, which do not leak to others."""
        with closing(items):
            while True:
                with timing_into(self.times), threading_by(self.threads):
                    item = next(items, None)
                if item is None:
                    return
                yield item

    def _decode(self, start: int, stop: int | None, follow: Follow | None) -> Generator[_Decoded]:
        """Decode frames, the first of them before `start` maybe; their CRCs are not looked at."""
        stated: list[int] = []
        decoder = _TimedDecoder(lambda _scene, state_crc: stated.append(state_crc))
        for chunk, state in walk_frames(self.source, decoder, start, stop, follow):
            size = len(chunk.payload)
            yield _Decoded(state.scene, stated.pop(), chunk.offset, size, decoder.nanoseconds)

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
                _prove(each)
                if each.scene.frame < start or (stop is not None and each.scene.frame >= stop):
                    continue
                with stage("floats"):
                    splats = dequantize(each.scene)
                spent = each.nanoseconds + time.perf_counter_ns() - begun
                yield Frame(each.scene, splats, each.chunk_bytes, spent)


class _TimedDecoder(StreamDecoder):
    """Knows how long the last chunk took, which its source may have kept waiting for before."""

    nanoseconds = 0

    def push(self, chunk: Chunk) -> State | None:
        """See `StreamDecoder.push`."""
        begun = time.perf_counter_ns()
        state = super().push(chunk)
        self.nanoseconds = time.perf_counter_ns() - begun
        return state


def _prove(decoded: _Decoded) -> None:
    try:
        prove_state(decoded.scene, decoded.state_crc)
    except BitstreamError as error:
        error.offset = decoded.offset
        raise
