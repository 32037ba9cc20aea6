"""Continues a partial stream without making its file shorter, because a reader may follow it."""

from typing import BinaryIO, cast

from quarc_ref.encoder.resume.partial_stream import PartialStream


def continue_stream(sink: BinaryIO, partial_stream: PartialStream) -> BinaryIO:
    """Return a sink that continues a partial stream, and only writes and flushes.

    Args:
        sink: File that contains the partial stream, open for reading and writing.
        partial_stream: The partial stream.
    """
    sink.seek(partial_stream.end)
    if partial_stream.is_damaged:
        sink.truncate()
    return cast("BinaryIO", OverwritingSink(sink))


class OverwritingSink:
    """A sink that overwrites the rest of a file, from its current position on.

    An interrupted write may have left the beginning of a chunk. A reader that follows the file on
    a server would take a shorter file for another one, so these bytes are removed only if they
    differ from those that are written.

    Args:
        file: The file, open for reading and writing.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def write(self, data: bytes) -> int:
        """Write bytes over the existing ones; if these differ, remove them and all later ones."""
        start = self._file.tell()
        existing_bytes = self._file.read(len(data))
        self._file.seek(start)
        if not data.startswith(existing_bytes):
            self._file.truncate()
        return self._file.write(data)

    def flush(self) -> None:
        """Flush the file."""
        self._file.flush()
