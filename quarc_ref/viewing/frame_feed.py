"""Frames ahead of the one that is shown, in bounded memory.

One thread decodes: first what is asked for, then what comes after it, round and
round, until as many frames are kept as there is room for. The frame that
will be wanted last is let go first. Where a frame has to be sought, decoding
begins at the canonical frame before it, and frames on the way are kept as well.
"""

import threading
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from typing import Generic, Protocol, TypeVar

_LEAST_KEPT = 2


class Keepable(Protocol):
    """What a feed keeps of a frame: it has an ordinal, and a size in memory."""

    @property
    def frame(self) -> int:
        """The ordinal."""
        ...

    @property
    def nbytes(self) -> int:
        """Bytes."""
        ...


Decoded = TypeVar("Decoded")
Kept = TypeVar("Kept", bound=Keepable)


class FrameFeed(Generic[Decoded, Kept]):
    """Gives out frames by their ordinals. Use as a context.

    Args:
        play: Decodes from a canonical frame on; whatever it played before has ended.
        canonical: Ordinals of the canonical frames, ascending.
        stop: Ordinal after the last frame.
        prepare: Makes of what is decoded what is given out, before the next is decoded.
        most_bytes: Of all frames that are kept; of two, at the least.
    """

    def __init__(
        self,
        play: Callable[[int], Iterator[Decoded]],
        canonical: Sequence[int],
        stop: int,
        prepare: Callable[[Decoded], Kept],
        most_bytes: int,
    ) -> None:
        self._play, self._prepare = play, prepare
        self._canonical, self._stop = canonical, stop
        self._most_bytes = most_bytes
        self._kept: dict[int, Kept] = {}
        self._largest = 1
        self._cursor = canonical[0]
        self._fault: Exception | None = None
        self._closed = False
        self._changed = threading.Condition()
        self._run: Iterator[Decoded] = iter(())
        self._next = -1
        self._thread = threading.Thread(target=self._work, name="decode", daemon=True)

    def __enter__(self) -> "FrameFeed[Decoded, Kept]":
        self._thread.start()
        return self

    def __exit__(self, *_fault: object) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()

    def get(self, frame: int, patience: float) -> Kept | None:
        """Return a frame, and have what follows it decoded.

        Args:
            frame: Its ordinal.
            patience: Seconds to wait for it.

        Returns:
            The frame; None if it is not decoded yet.

        Raises:
            Exception: What kept the frame, or one before it, from being decoded.
        """
        with self._changed:
            self._cursor = frame
            self._changed.notify_all()
            self._changed.wait_for(lambda: frame in self._kept or self._is_lost(frame), patience)
            if self._is_lost(frame) and self._fault is not None:
                raise self._fault
            return self._kept.get(frame)

    def count_kept(self) -> tuple[int, int]:
        """Return how many frames are kept, and their bytes."""
        with self._changed:
            return len(self._kept), sum(frame.nbytes for frame in self._kept.values())

    def _is_lost(self, frame: int) -> bool:
        return frame >= self._stop

    def _work(self) -> None:
        while (frame := self._await_work()) is not None:
            try:
                ready = self._decode_towards(frame)
            except Exception as fault:  # handed to whoever asks for the frame
                self._lose(self._next, fault)
            else:
                self._keep(ready)

    def _await_work(self) -> int | None:
        """Return the frame to decode next; None once closed."""
        with self._changed:
            while not self._closed:
                frame = self._find_missing()
                if frame is not None:
                    return frame
                self._changed.wait()
        return None

    def _find_missing(self) -> int | None:
        """Return the first frame from the cursor on that is not kept and has room."""
        count = self._stop - self._canonical[0]
        room = self._capacity() - len(self._kept)
        farthest = max(map(self._distance, self._kept), default=0)
        for distance in range(count):
            frame = self._canonical[0] + (self._cursor - self._canonical[0] + distance) % count
            if frame not in self._kept:
                return frame if room > 0 or distance < farthest else None
        return None

    def _distance(self, frame: int) -> int:
        """Return how many frames are shown before this one comes."""
        return (frame - self._cursor) % max(1, self._stop - self._canonical[0])

    def _capacity(self) -> int:
        return max(_LEAST_KEPT, self._most_bytes // self._largest)

    def _decode_towards(self, frame: int) -> Kept:
        start = self._canonical[bisect_right(self._canonical, frame) - 1]
        if not start <= self._next <= frame:
            self._run, self._next = self._play(start), start
        return self._prepare(next(self._run))

    def _keep(self, ready: Kept) -> None:
        with self._changed:
            self._next = ready.frame + 1
            self._kept[ready.frame] = ready
            self._largest = max(self._largest, ready.nbytes)
            while len(self._kept) > self._capacity():
                del self._kept[max(self._kept, key=self._distance)]
            self._changed.notify_all()

    def _lose(self, frame: int, fault: Exception) -> None:
        """Take it that a frame, and what follows, cannot be decoded."""
        with self._changed:
            self._stop, self._fault = frame, fault
            self._kept = {number: kept for number, kept in self._kept.items() if number < frame}
            self._next = -1
            self._changed.notify_all()
