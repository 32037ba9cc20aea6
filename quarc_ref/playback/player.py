"""A stream that plays: frames are decoded ahead, in a thread of their own.

    with Player(source) as player:
        for frame in player:
            draw(frame.splats)

`frame_pipeline` does the work.
"""

from collections.abc import Callable, Iterator
from types import TracebackType

from quarc_ref.playback.frame_pipeline import Frame, FramePipeline, Frames, Times
from quarc_ref.streams.follow import Follow
from quarc_ref.streams.source import Source, as_source


class Player:
    """Plays the frames of a stream. One run at a time: a new one ends the one before.

    Args:
        stream: A stream, which the caller closes after the player.
        threads: 1 to decode frames on demand; 2 or more to decode ahead, with an engine that may
            use that many threads.
        prefetch: Number of frames that may be buffered, at least 1. It bounds memory: a buffered
            frame takes about 200 bytes per Gaussian.
        follow: How long to wait for a growing stream; None not to wait.

    Attributes:
        times: Nanoseconds by stage, of all frames so far.

    Raises:
        ValueError: Of threads or of frames there are less than 1.
    """

    def __init__(
        self,
        stream: bytes | Source,
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
        """End what runs; the player can be used again.

        A read of the source that is under way is waited for.
        """
        if self._run is not None:
            self._run.close()
        self._run, self._due = None, -1

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        """Play from a frame on, found through the stream's seek points.

        Args:
            start: Ordinal of the first frame.
            stop: Ordinal after the last one; None for all.

        Yields:
            The frames in order.

        Raises:
            BitstreamError: The stream is invalid; all frames before the error have been yielded.
            SourceError: The file, pipe or server cannot be read.
        """
        self.close()
        run = self._run = self._pipeline.make(start, stop)
        return run

    def frame(self, ordinal: int) -> Frame:
        """Return one frame. The following frames are decoded ahead.

        Raises:
            LookupError: The stream has no such frame.
            BitstreamError: As for `frames`.
            SourceError: As for `frames`.
        """
        if self._due < 0 or not self._due <= ordinal <= self._due + self._prefetch:
            self.frames(ordinal)
        frame = None
        try:
            frame = self._go_to(ordinal)
        finally:
            if frame is None:  # of a run that has ended nothing can be had
                self.close()
        if frame is None:
            message = f"the stream has no frame {ordinal}"
            raise LookupError(message)
        return frame

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

    def _go_to(self, ordinal: int) -> Frame | None:
        """Return a frame of the current run, not before the next one; None past its end."""
        for frame in self._run or ():
            self._due = frame.state.frame + 1
            if frame.state.frame >= ordinal:
                return frame if frame.state.frame == ordinal else None
        return None
