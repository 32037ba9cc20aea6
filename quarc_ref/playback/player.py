"""Plays a stream; background threads decode frames in advance.

    with Player(source) as player:
        for frame in player:
            draw(frame.splats)

The frames are decoded in `frame_pipeline`.
"""

from collections.abc import Iterator
from types import TracebackType

from quarc_ref.playback.frame_pipeline import Frame, FramePipeline, Frames, Times
from quarc_ref.streams.source import BytesLike, Source, as_source


class Player:
    """Plays the frames of a stream.

    A run plays frames in order from a start frame. Starting a run ends the previous run.

    Args:
        stream: The stream, as a bytes-like object or as a source, which must not be closed before
            the player.
        threads: 1 to decode frames on demand; 2 or more to decode in advance, with an
            engine that may use this number of threads, but at most 64.

    Attributes:
        times: Nanoseconds by stage, summed over all frames so far.

    Raises:
        ValueError: `threads` is below 1.
    """

    def __init__(self, stream: BytesLike | Source, *, threads: int = 2) -> None:
        if threads < 1:
            message = f"threads ({threads}) must be at least 1"
            raise ValueError(message)
        self.times = Times()
        self._pipeline = FramePipeline(as_source(stream), threads, self.times)
        self._run: Frames | None = None

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
        self._run = None

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
