"""A stream that several threads read."""

import threading

from quarc_ref.streams.source import Source


class SharedSource:
    """Reads of another source, one at a time: a file has one place where it is read.

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
