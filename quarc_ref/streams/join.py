"""Joins streams with the same header.

Canonical frames do not depend on anything before them (SPEC 7.2), so nothing is decoded or
re-encoded. Only the frame numbers of keyframes change; states and digests stay the same.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from typing import BinaryIO

from quarc_ref.format import container, wire
from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import COUNTER_LIMIT
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import BitstreamError, EditError
from quarc_ref.format.layouts import VERSION
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams.frame_walk import FrameWalk, Step
from quarc_ref.streams.source import Source
from quarc_ref.streams.stream_writer import StreamWriter

_LEVEL_PLACE = VERSION.sizeof()
_FRAME_BYTES = 4


def join(sources: Sequence[Source], sink: BinaryIO) -> int:
    """Write the frames of several streams as one stream.

    The first stream keeps its ordinals, and those of the others are shifted. HEAD is that
    of the first stream with the highest level of all streams. Cameras must be the same in
    all streams, and only the metadata entries that are the same in all streams are kept.
    Ancillary chunks of unknown types are copied in place; identical ones at the start of
    several streams are copied once.

    Args:
        sources: Streams, which are read twice, so pipes are not allowed.
        sink: Binary file to which the result is appended, after all streams have been checked.

    Returns:
        Number of frames written.

    Raises:
        EditError: The streams are not compatible.
        BitstreamError: A stream is invalid; the message names it.
        SourceError: A file or server cannot be read.
    """
    parts = []
    for number, source in enumerate(sources, 1):
        with _number_errors(number):
            parts.append(_inspect_part(source))
    if not parts:
        message = "no streams to join"
        raise EditError(message)
    for number, part in enumerate(parts[1:], 2):
        _require_joinable(parts[0], part, number)
    joining = _Joining(sink, parts)
    for number, source in enumerate(sources, 1):
        with _number_errors(number):
            joining.append(FrameWalk(source))
    return joining.finish()


@dataclass(frozen=True, slots=True)
class _Part:
    """Properties in which joined streams must agree.

    Attributes:
        head: Payload of HEAD.
        cameras: Content of the last `came`; None if there is none.
        metadata: Content of the last `meta`; None if there is none.
    """

    head: bytes
    cameras: tuple[Camera, ...] | None
    metadata: dict[str, str] | None


@contextmanager
def _number_errors(number: int) -> Iterator[None]:
    """Add the number of the stream to an error."""
    try:
        yield
    except BitstreamError as error:
        error.args = (f"stream {number}: {error.args[0]}",)
        raise


def _inspect_part(source: Source) -> _Part:
    walk = FrameWalk(source)
    latest = {
        step.header.kind: walk.take(step).payload
        for step in walk
        if step.header.kind in (container.CAME, container.META)
    }
    came, meta = latest.get(container.CAME), latest.get(container.META)
    return _Part(
        walk.head,
        None if came is None else wire.parse_cameras(came),
        None if meta is None else wire.parse_metadata(meta),
    )


def _require_joinable(first: _Part, part: _Part, number: int) -> None:
    """Raise EditError if a stream cannot be joined to the first."""
    headers = [wire.parse_stream_header(each.head) for each in (first, part)]
    differ = [
        f"{field.name} ({getattr(headers[0], field.name)} and {getattr(headers[1], field.name)})"
        for field in fields(StreamHeader)
        if field.name != "level"
        and getattr(headers[0], field.name) != getattr(headers[1], field.name)
    ]
    if first.head[:_LEVEL_PLACE] != part.head[:_LEVEL_PLACE]:
        differ.append("compatible_features")
    if differ:
        message = f"stream {number} differs from the first in {', '.join(differ)}"
        raise EditError(message)
    if first.cameras != part.cameras:
        message = f"stream {number} has different cameras from the first"
        raise EditError(message)


class _Joining:
    """A joined stream that is being written.

    Args:
        sink: Binary file to which the stream is appended.
        parts: Properties of all streams.
    """

    def __init__(self, sink: BinaryIO, parts: Sequence[_Part]) -> None:
        head = parts[0].head
        level = max(part.head[_LEVEL_PLACE] for part in parts)
        head = head[:_LEVEL_PLACE] + bytes([level]) + head[_LEVEL_PLACE + 1 :]
        self._writer = StreamWriter(sink, head)
        self._due: int | None = None  # ordinal of the next frame
        self._shift = 0
        self._begun: set[tuple[bytes, bytes]] = set()  # chunks at the start of streams
        if parts[0].cameras is not None:
            self._writer.write(container.CAME, wire.build_cameras(parts[0].cameras))
        if any(part.metadata is not None for part in parts):
            self._writer.write(container.META, wire.build_metadata(_common_metadata(parts)))

    def append(self, walk: FrameWalk) -> None:
        """Append the frames of a stream."""
        due, is_first = self._due, True
        for step in walk:
            if step.is_frame and step.frame is not None:
                if is_first:
                    self._shift = 0 if due is None else due - step.frame
                is_first = False
                self._due = self._place(step.frame) + 1
            if step.header.kind not in (container.CAME, container.META):
                self._write(step, walk.take(step))

    def finish(self) -> int:
        """Write the end of the stream; return its number of frames."""
        self._writer.finish()
        return self._writer.frame_count

    def _write(self, step: Step, chunk: Chunk) -> None:
        payload = chunk.payload
        if step.frame is None:
            if (chunk.kind, payload) in self._begun:
                return
            self._begun.add((chunk.kind, payload))
        elif step.is_canonical:
            payload = self._shifted(payload, 0)
            if chunk.kind == container.SNAP:
                payload = self._shifted(payload, _FRAME_BYTES)
        self._writer.write(chunk.kind, payload)

    def _shifted(self, payload: bytes, place: int) -> bytes:
        """Shift the frame number at a byte offset of a payload."""
        end = place + _FRAME_BYTES
        ordinal = self._place(int.from_bytes(payload[place:end], "little"))
        return payload[:place] + ordinal.to_bytes(_FRAME_BYTES, "little") + payload[end:]

    def _place(self, frame: int) -> int:
        """Return the frame number in the joined stream."""
        place = frame + self._shift
        if place > COUNTER_LIMIT:
            message = f"frame numbers are limited to {COUNTER_LIMIT}"
            raise EditError(message)
        return place


def _common_metadata(parts: Sequence[_Part]) -> dict[str, str]:
    """Return the metadata that is the same in all streams, in the order of the first."""
    said = [part.metadata or {} for part in parts]
    return {
        key: text for key, text in said[0].items() if all(other.get(key) == text for other in said)
    }
