"""Extracts frames of a stream as a new stream.

The first frame must be a keyframe. Chunks are copied unchanged, except snapshots whose
CANO is not included. Frame numbers are preserved (SPEC 11.1), and with them times,
digests and the correspondence to pictures of the capture.
"""

from collections.abc import Iterator
from contextlib import suppress
from typing import BinaryIO, NoReturn

from quarc_ref.format import container
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import EditError, TruncatedError
from quarc_ref.streams.frame_walk import FrameWalk, Step
from quarc_ref.streams.rebase import Rebase
from quarc_ref.streams.source import Source
from quarc_ref.streams.stream_writer import StreamWriter


def cut(source: Source, start: int | None, stop: int | None, sink: BinaryIO) -> int:
    """Write the frames of a stream from a keyframe on.

    Other chunks are kept if they precede the stream's first frame or follow a kept frame.
    The last `came` and `meta` chunks before `start` are kept as well, because they apply
    to all later frames. Bytes after the requested frames are not read, because the stream
    may be damaged there or still grow.

    Args:
        source: A stream.
        start: Ordinal of the first frame; None for the stream's first one.
        stop: Ordinal after the last frame; None for all.
        sink: Binary file to which the result is appended, after `start` has been found.

    Returns:
        Number of frames written.

    Raises:
        EditError: Frame `start` does not exist, is not canonical, or is not before `stop`.
        BitstreamError: The stream is invalid.
        SourceError: The file, pipe or server cannot be read.
    """
    walk, passed = FrameWalk(source), _SkippedFrames()
    steps = iter(walk)
    first = _find(steps, start, walk, passed)
    if first.frame is not None and stop is not None and stop <= first.frame:
        message = f"there is no frame between frame {first.frame} and frame {stop}"
        raise EditError(message)
    writer = StreamWriter(sink, walk.head)
    for chunk in passed.chunks():
        writer.write(chunk.kind, chunk.payload)
    copying = _Copying(writer, walk, passed.reference)
    copying.copy(first)
    for step in steps:
        if step.is_frame and step.frame == stop:
            break
        copying.copy(step)
    writer.finish()
    return writer.frame_count


class _SkippedFrames:
    """State that a cut needs from skipped frames.

    Attributes:
        canonical: Ordinal of the last skipped canonical frame.
        reference: The last skipped CANO, if snapshots may refer to it.
    """

    def __init__(self) -> None:
        self.canonical: int | None = None
        self.reference: Chunk | None = None
        self._prologue: list[Chunk] = []
        self._latest: dict[bytes, Chunk] = {}

    def note(self, step: Step, walk: FrameWalk) -> None:
        """Record a step of the walk."""
        if step.is_canonical:
            self.canonical = step.frame
            if walk.header.snapshots and step.header.kind == container.CANO:
                self.reference = walk.take(step)
        elif step.frame is None:
            self._prologue.append(walk.take(step))
        elif step.header.kind in (container.CAME, container.META):
            self._latest[step.header.kind] = walk.take(step)

    def chunks(self) -> list[Chunk]:
        """Return the chunks to write before the first frame, in stream order."""
        return self._prologue + sorted(self._latest.values(), key=lambda chunk: chunk.sequence)


def _find(
    steps: Iterator[Step], start: int | None, walk: FrameWalk, passed: _SkippedFrames
) -> Step:
    """Find the first requested frame; `passed` collects the chunks before it."""
    for step in steps:
        if step.is_frame and (start is None or (step.frame or 0) >= start):
            if start is None or (step.is_canonical and step.frame == start):
                return step
            _reject(start, passed.canonical, step, steps)
        passed.note(step, walk)
    near = _describe_nearest(passed.canonical, None)
    message = f"the stream has no frame {'at all' if start is None else start}{near}"
    raise EditError(message)


def _reject(start: int, before: int | None, step: Step, steps: Iterator[Step]) -> NoReturn:
    """Raise EditError that names the keyframes before and after a frame."""
    after = step.frame if step.is_canonical else None
    with suppress(TruncatedError):
        after = after or next((other.frame for other in steps if other.is_canonical), None)
    fault = f"frame {start} is not canonical, so a stream cannot begin with it"
    if step.frame != start:
        fault = f"the stream has no frame {start}"
    raise EditError(fault + _describe_nearest(before, after))


class _Copying:
    """Writes chunks unchanged, except snapshots whose CANO is not included.

    Args:
        writer: Writer of the new stream.
        walk: Walk of the stream.
        reference: The CANO that is not included, if snapshots refer to it.
    """

    def __init__(self, writer: StreamWriter, walk: FrameWalk, reference: Chunk | None) -> None:
        self._writer, self._walk, self._reference = writer, walk, reference
        self._rebase: Rebase | None = None

    def copy(self, step: Step) -> None:
        """Write the chunk of a step."""
        chunk = self._walk.take(step)
        if chunk.kind == container.CANO:
            self._reference = None
        elif chunk.kind == container.SNAP and self._reference is not None:
            self._rebase = self._rebase or Rebase(self._walk.header, self._reference)
            chunk = self._rebase.take(chunk)
        self._writer.write(chunk.kind, chunk.payload)


def _describe_nearest(before: int | None, after: int | None) -> str:
    near = [str(frame) for frame in (before, after) if frame is not None]
    if not near:
        return ""
    return (
        f"; the nearest canonical frame{'s are' if len(near) > 1 else ' is'} {' and '.join(near)}"
    )
