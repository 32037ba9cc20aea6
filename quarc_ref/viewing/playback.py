"""Which frame is to be shown when: a timeline that plays, pauses and jumps.

Every frame is shown: where decoding or the page cannot keep the pace, time
passes more slowly, and the frame rate that is told says so.
"""

import threading
import time
from collections.abc import Callable


class Playback:
    """The state of a player, which several threads change and one follows.

    Args:
        first: Ordinal of the first frame.
        stop: Ordinal after the last one.
        pace: Frames per second.
        clock: Seconds, monotonic.
    """

    def __init__(
        self,
        first: int,
        stop: int,
        pace: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._first, self._stop, self._pace = first, stop, pace
        self._clock = clock
        self._changed = threading.Condition()
        self._frame = first
        self._is_shown = False
        self._is_playing = False
        self._speed = 1.0
        self._due = clock()

    @property
    def is_playing(self) -> bool:
        """Whether frames follow one another."""
        return self._is_playing

    def play(self, *, on: bool = True) -> None:
        """Play, or pause."""
        with self._changed:
            self._is_playing = on
            self._due = self._clock()
            self._changed.notify_all()

    def set_speed(self, speed: float) -> None:
        """Play so many times as fast as the stream asks for."""
        with self._changed:
            self._speed = speed
            self._changed.notify_all()

    def seek(self, frame: int) -> None:
        """Show a frame, and go on from there if playing."""
        with self._changed:
            if frame != self._frame:
                self._frame, self._is_shown = frame, False
                self._changed.notify_all()

    def await_frame(self, patience: float) -> int | None:
        """Return the frame that is to be shown now.

        Args:
            patience: Seconds to wait for one.

        Returns:
            Its ordinal, again and again until it is said to be shown; None if
            there is none.
        """
        give_up = self._clock() + patience
        with self._changed:
            while (left := self._seconds_left()) is None or left > 0:
                wait = min(give_up - self._clock(), patience if left is None else left)
                if wait <= 0 and self._clock() >= give_up:
                    return None
                self._changed.wait(max(0.0, wait))
            if self._is_shown:
                self._step()
            return self._frame

    def mark_shown(self, frame: int) -> None:
        """Take it that a frame is on the page."""
        with self._changed:
            if frame == self._frame:
                self._is_shown = True
                self._due = max(self._due + 1 / (self._pace * self._speed), self._clock())

    def _seconds_left(self) -> float | None:
        """Return the seconds until a frame is to be shown; None while pausing."""
        if not self._is_shown:
            return 0.0
        return self._due - self._clock() if self._is_playing else None

    def _step(self) -> None:
        self._frame = self._frame + 1 if self._frame + 1 < self._stop else self._first
        self._is_shown = False
