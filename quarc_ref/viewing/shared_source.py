"""Sources that several threads can read at the same time."""

import threading
import time

from quarc_ref.streams.source import Source

_POLL_SECONDS = 0.2


class SharedSource:
    """Serializes reads by several threads, because a file has only one read position.

    Args:
        source: The stream.
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._lock = threading.Lock()

    def read(self, offset: int, length: int) -> bytes:
        """See `Source.read`."""
        with self._lock:
            return self._source.read(offset, length)

    def size(self) -> int | None:
        """See `Source.size`."""
        with self._lock:
            return self._source.size()


class GrowingSource(SharedSource):
    """A source for a growing stream; it can wait for new bytes.

    Args:
        source: The stream.
        max_wait_seconds: Maximum time to wait for new data, seconds.
    """

    def __init__(self, source: Source, max_wait_seconds: float = 20.0) -> None:
        super().__init__(source)
        self._max_wait_seconds = max_wait_seconds

    def wait_for_data(self, offset: int) -> None:
        """Wait until the stream has a byte at an offset, for at most `max_wait_seconds`."""
        deadline = time.monotonic() + self._max_wait_seconds
        while (self.size() or 0) <= offset and time.monotonic() < deadline:
            time.sleep(_POLL_SECONDS)
