"""Plays a stream; background threads decode frames in advance.

    with Player(source) as player:
        for frame in player:
            draw(frame.splats)

The frames are decoded in `frame_pipeline`.
"""

from collections.abc import Callable, Iterator
from types import TracebackType

from quarc_ref.playback.frame_pipeline import Frame, FramePipeline, Frames, Times
from quarc_ref.streams.follow import Follow
from quarc_ref.streams.source import BytesLike, Source, as_source


class Player:
    """Plays the frames of a stream.

    A run plays frames in order from a start frame. Starting a run ends the previous run.

    Args:
        stream: The stream, as a bytes-like object or as a source, which must not be closed before
            the player.
        threads: 1 to decode frames on demand; 2 or more to decode in advance, with an
            engine that may use this number of threads, but at most 64.
        prefetch: Maximum number of frames that are converted to floats in advance, including
            the one that is being converted; at least 1. A frame takes about 150 bytes per
            Gaussian.
        follow: How to wait for a growing stream; None to stop at the stream's current end.

    Attributes:
        times: Nanoseconds by stage, summed over all frames so far.

    Raises:
        ValueError: `threads` or `prefetch` is below 1.
    """

    def __init__(
        self,
        stream: BytesLike | Source,
        *,
        threads: int = 2,
        prefetch: int = 2,
        follow: Follow | None = None,
    ) -> None:
        if threads < 1 or prefetch < 1:
            message = f"threads ({threads}) and prefetch ({prefetch}) must be at least 1"
            raise ValueError(message)
        self.times = Times()
        self._prefetch = prefetch
        self._pipeline = FramePipeline(as_source(stream), threads, prefetch, follow, self.times)
        self._run: Frames | None = None
        self._next_ordinal = -1  # next frame that `frame` can take from the run; -1: none

    def __enter__(self) -> "Player":
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __iter__(self) -> Iterator[Frame]:
        return self.frames()

    def close(self) -> None:
        """End the current run; the player can still start new runs.

        If the source is being read, `close` waits until the read ends.
        """
        if self._run is not None:
            self._run.close()
        self._run, self._next_ordinal = None, -1

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        """Play the frames from `start` to `stop` - 1, using the stream's seek points.

        Args:
            start: Ordinal of the first frame.
            stop: Ordinal of the frame before which playback ends; None: play all remaining frames.

        Yields:
            The frames in order.

        Raises:
            BitstreamError: The stream is invalid; all frames before the error have been yielded.
            SourceError: The file, pipe or server cannot be read.
        """
        self.close()
        run = self._run = self._pipeline.make_frames(start, stop)
        return run

    def frame(self, ordinal: int) -> Frame:
        """Return a frame, and decode the following frames in advance.

        Raises:
            LookupError: The stream has no such frame.
            BitstreamError: See `frames`.
            SourceError: See `frames`.
        """
        if (
            self._next_ordinal < 0
            or not self._next_ordinal <= ordinal <= self._next_ordinal + self._prefetch
        ):
            self.frames(ordinal)
        frame = None
        try:
            frame = self._advance_to(ordinal)
        finally:
            if frame is None:  # the run has ended or failed
                self.close()
        if frame is None:
            message = f"the stream has no frame {ordinal}"
            raise LookupError(message)
        return frame

    def play(
        self, show: Callable[[Frame], object], start: int = 0, stop: int | None = None
    ) -> None:
        """Call a function for every frame in order, in the caller's thread.

        Raises:
            BitstreamError: See `frames`.
            SourceError: See `frames`.
        """
        for frame in self.frames(start, stop):
            show(frame)

    def _advance_to(self, ordinal: int) -> Frame | None:
        """Return a frame from the rest of the current run; None if the run ends before it."""
        for frame in self._run or ():
            self._next_ordinal = frame.state.frame + 1
            if frame.state.frame >= ordinal:
                return frame if frame.state.frame == ordinal else None
        return None
