"""Joins streams whose headers are the same except for the level.

Canonical frames do not depend on earlier frames (SPEC 7.2), so no frame is decoded or
re-encoded. Only the frame numbers of keyframes change; states and digests stay the same.
"""

import re
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
from quarc_ref.streams.resync import ORDINAL_BYTES
from quarc_ref.streams.source import Source
from quarc_ref.streams.stream_writer import StreamWriter

_LEVEL_OFFSET = VERSION.sizeof()


def join(sources: Sequence[Source], sink: BinaryIO) -> int:
    """Write the frames of several streams as one stream.

    The first stream keeps its frame numbers; those of the other streams are shifted. HEAD is
    copied from the first stream, except that its level is the highest level of all streams.
    Cameras must be the same in all streams, and neither the cameras nor the metadata of a stream
    may change after its first frame. Only the metadata entries that are the same in all
    streams are kept, and `start` of the first stream; `start` and `fingerprint` are dropped if the
    frames of the streams do not follow each other in the capture. Ancillary chunks of unknown types
    keep their places between frames; identical chunks before the first frames of several streams
    are copied only once.

    Args:
        sources: Streams, which are read twice, so pipes are not allowed.
        sink: Binary file to which the result is appended, after all streams have been checked.

    Returns:
        Number of frames written.

    Raises:
        EditError: The streams are not compatible.
        BitstreamError: A stream is invalid; the message contains the stream's number.
        SourceError: A file or server cannot be read.
    """
    parts = []
    for number, source in enumerate(sources, 1):
        with _prefix_errors(number):
            parts.append(_inspect_part(source, number))
    if not parts:
        message = "no streams to join"
        raise EditError(message)
    for number, part in enumerate(parts[1:], 2):
        _require_joinable(parts[0], part, number)
    joiner = _StreamJoiner(sink, parts)
    for number, source in enumerate(sources, 1):
        with _prefix_errors(number):
            joiner.append(FrameWalk(source))
    return joiner.finish()


@dataclass(frozen=True, slots=True)
class _Part:
    """The contents of a stream that are compared before streams are joined.

    Attributes:
        head: Payload of HEAD.
        cameras: Content of the last `came` chunk; None if there is none.
        metadata: Content of the last `meta` chunk; None if there is none.
        frames: Ordinals of the frames.
    """

    head: bytes
    cameras: tuple[Camera, ...] | None
    metadata: dict[str, str] | None
    frames: range


@contextmanager
def _prefix_errors(number: int) -> Iterator[None]:
    """Prefix the message of an error with the number of the stream."""
    try:
        yield
    except BitstreamError as error:
        error.args = (f"stream {number}: {error.args[0]}",)
        raise


def _inspect_part(source: Source, number: int) -> _Part:
    """Read what is compared before streams are joined.

    Raises:
        EditError: The cameras or the metadata change after the first frame.
        BitstreamError: The stream is invalid.
    """
    walk, frames = FrameWalk(source), range(0)
    cameras: tuple[Camera, ...] | None = None
    metadata: dict[str, str] | None = None
    for step in walk:
        if step.header.kind == container.CAME:
            earlier_cameras, cameras = cameras, wire.parse_cameras(walk.take(step).payload)
            if cameras != earlier_cameras:
                _require_before_frames(step, number, "cameras")
        elif step.header.kind == container.META:
            earlier_metadata, metadata = metadata, wire.parse_metadata(walk.take(step).payload)
            if metadata != earlier_metadata:
                _require_before_frames(step, number, "metadata")
        elif step.is_frame and step.frame is not None:
            frames = range(frames.start if frames else step.frame, step.frame + 1)
    return _Part(walk.head, cameras, metadata, frames)


def _require_before_frames(step: Step, number: int, content: str) -> None:
    """Raise EditError if a chunk that changes the cameras or metadata follows a frame.

    The joined stream has both only at its beginning, so they would apply to earlier frames.
    """
    if step.frame is not None:
        message = f"stream {number} has other {content} after frame {step.frame} than before; "
        message += "streams in which they change cannot be joined"
        raise EditError(message)


def _require_joinable(first: _Part, part: _Part, number: int) -> None:
    """Raise EditError if a stream cannot be joined to the first."""
    headers = [wire.parse_stream_header(compared_part.head) for compared_part in (first, part)]
    differences = [
        f"{field.name} ({getattr(headers[0], field.name)} and {getattr(headers[1], field.name)})"
        for field in fields(StreamHeader)
        if field.name != "level"
        and getattr(headers[0], field.name) != getattr(headers[1], field.name)
    ]
    versions = [VERSION.parse(compared_part.head) for compared_part in (first, part)]
    differences += [
        f"{name} ({versions[0][name]} and {versions[1][name]})"
        for name in ("version_minor", "compatible_features")
        if versions[0][name] != versions[1][name]
    ]
    if differences:
        message = f"stream {number} differs from the first in {', '.join(differences)}"
        raise EditError(message)
    if first.cameras != part.cameras:
        message = f"stream {number} and the first stream have different cameras"
        raise EditError(message)


class _StreamJoiner:
    """Writes the joined stream.

    Args:
        sink: Binary file to which the stream is appended.
        parts: The contents that were compared, for all streams.
    """

    def __init__(self, sink: BinaryIO, parts: Sequence[_Part]) -> None:
        head = parts[0].head
        level = max(part.head[_LEVEL_OFFSET] for part in parts)
        head = head[:_LEVEL_OFFSET] + bytes([level]) + head[_LEVEL_OFFSET + 1 :]
        self._writer = StreamWriter(sink, head)
        self._next_frame: int | None = None  # ordinal of the next frame
        self._frame_shift = 0
        self._prologue_chunks: set[tuple[bytes, bytes]] = set()  # chunks before first frames
        if parts[0].cameras is not None:
            self._writer.write(container.CAME, wire.build_cameras(parts[0].cameras))
        if any(part.metadata is not None for part in parts):
            self._writer.write(container.META, wire.build_metadata(_common_metadata(parts)))

    def append(self, walk: FrameWalk) -> None:
        """Append the frames of a stream."""
        start_frame, is_first_frame = self._next_frame, True
        for step in walk:
            if step.is_frame and step.frame is not None:
                if is_first_frame:
                    self._frame_shift = 0 if start_frame is None else start_frame - step.frame
                is_first_frame = False
                self._next_frame = self._joined_frame(step.frame) + 1
            if step.header.kind not in (container.CAME, container.META):
                self._write(step, walk.take(step))

    def finish(self) -> int:
        """Write INDX and TAIL; return the number of frames in the stream."""
        self._writer.finish()
        return self._writer.frame_count

    def _write(self, step: Step, chunk: Chunk) -> None:
        payload = chunk.payload
        if step.frame is None:
            if (chunk.kind, payload) in self._prologue_chunks:
                return
            self._prologue_chunks.add((chunk.kind, payload))
        elif step.is_canonical:
            payload = self._shift_ordinal(payload, 0)
            if chunk.kind == container.SNAP:
                payload = self._shift_ordinal(payload, ORDINAL_BYTES)
        self._writer.write(chunk.kind, payload)

    def _shift_ordinal(self, payload: bytes, offset: int) -> bytes:
        """Return the payload with the shift added to the frame number at byte `offset`."""
        end = offset + ORDINAL_BYTES
        ordinal = self._joined_frame(int.from_bytes(payload[offset:end], "little"))
        return payload[:offset] + ordinal.to_bytes(ORDINAL_BYTES, "little") + payload[end:]

    def _joined_frame(self, frame: int) -> int:
        """Return the number that a frame has in the joined stream."""
        joined_frame = frame + self._frame_shift
        if joined_frame > COUNTER_LIMIT:
            message = f"frame numbers are limited to {COUNTER_LIMIT}"
            raise EditError(message)
        return joined_frame


def _common_metadata(parts: Sequence[_Part]) -> dict[str, str]:
    """Return the entries that are the same in all streams, in the order of the first stream.

    `start` is the number that frame 0 of the stream has in the capture. It is that of the first
    stream, whose frame numbers do not change. If the frames are not consecutive in the capture,
    neither `start` nor `fingerprint` is returned, because the joined stream is not of that capture.
    """
    metadata_by_part = [part.metadata or {} for part in parts]
    capture_keys = {"start", "fingerprint"} if not _are_consecutive(parts) else set()
    return {
        key: text
        for key, text in metadata_by_part[0].items()
        if key not in capture_keys
        and (
            key == "start"
            or all(part_metadata.get(key) == text for part_metadata in metadata_by_part)
        )
    }


def _are_consecutive(parts: Sequence[_Part]) -> bool:
    """Return whether each stream begins with the frame of the capture after the previous stream."""
    next_frame = None
    for part in parts:
        start = (part.metadata or {}).get("start", "0")
        if not part.frames:
            continue
        if not re.fullmatch("[0-9]{1,9}", start):
            return False
        if next_frame not in (None, int(start) + part.frames.start):
            return False
        next_frame = int(start) + part.frames.stop
    return True
