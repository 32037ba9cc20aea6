"""Sources that several threads can read."""

import threading
import time

from quarc_ref.streams.source import Source

_POLL_SECONDS = 0.2


class SharedSource:
    """Serializes reads of another source, because a file has only one position.

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
    """A source of a growing stream, whose reads wait for new bytes.

    Args:
        source: The stream.
        patience: Maximum seconds to wait for new data, for each read.
    """

    def __init__(self, source: Source, patience: float = 20.0) -> None:
        super().__init__(source)
        self._patience = patience

    def wait_for_data(self, offset: int) -> None:
        """Wait for a byte at an offset, or for a timeout without new data."""
        give_up = time.monotonic() + self._patience
        while (self.size() or 0) <= offset and time.monotonic() < give_up:
            time.sleep(_POLL_SECONDS)
