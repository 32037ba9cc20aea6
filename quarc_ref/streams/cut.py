"""Copies consecutive frames of a stream to a new stream.

The first frame must be a keyframe. Chunks are copied unchanged, except snapshots whose CANO is not
part of the cut. Frame numbers do not change (SPEC 11.1), so times and digests stay the same, and
frames still correspond to the pictures of the capture.
"""

from collections.abc import Iterator
from contextlib import suppress
from typing import BinaryIO, NoReturn

from quarc_ref.format import container
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import EditError, TruncatedError
from quarc_ref.streams.frame_walk import FrameWalk, Step
from quarc_ref.streams.rebase import SnapshotRebaser
from quarc_ref.streams.source import Source
from quarc_ref.streams.stream_writer import StreamWriter

_SIDE_DATA = (container.CAME, container.META)


def cut(source: Source, start: int | None, stop: int | None, sink: BinaryIO) -> int:
    """Write the frames from `start` to `stop` - 1 of a stream as a new stream.

    Chunks that are not frames are copied if they are before the stream's first frame or after
    a copied frame. `came` and `meta` chunks apply to all later frames: the last ones before
    `start` are also copied, and those between the last copied frame and `stop` are not. Bytes after
    the requested frames are not read, because they may be damaged or not yet written.

    Args:
        source: A stream.
        start: Ordinal of the first frame; None for the first frame of the stream.
        stop: Ordinal of the first frame after the cut; None to include all later frames.
        sink: Binary file to which the result is appended once `start` has been found.

    Returns:
        Number of frames written.

    Raises:
        EditError: Frame `start` does not exist, is not a keyframe, or is not before `stop`.
        BitstreamError: The stream is invalid.
        SourceError: The file, pipe or server cannot be read.
    """
    walk, skipped = FrameWalk(source), _SkippedFrames()
    steps = iter(walk)
    first = _find_first(steps, start, walk, skipped)
    if first.frame is not None and stop is not None and stop <= first.frame:
        message = f"the cut is empty: it begins at frame {first.frame} and ends before frame {stop}"
        raise EditError(message)
    writer = StreamWriter(sink, walk.head)
    for chunk in skipped.chunks():
        writer.write(chunk.kind, chunk.payload)
    copier = _ChunkCopier(writer, walk, skipped.reference)
    copier.copy(first)
    for step in steps:
        if step.is_frame and step.frame == stop:
            copier.drop_side_data()
            break
        copier.copy(step)
    copier.write_held_chunks()
    writer.finish()
    return writer.frame_count


class _SkippedFrames:
    """What a cut needs to know about the frames that it skips.

    Attributes:
        last_keyframe: Ordinal of the last skipped canonical frame (CANO or SNAP).
        reference: The last skipped CANO, if snapshots may refer to it.
    """

    def __init__(self) -> None:
        self.last_keyframe: int | None = None
        self.reference: Chunk | None = None
        self._prologue: list[Chunk] = []
        self._latest_by_kind: dict[bytes, Chunk] = {}

    def add(self, step: Step, walk: FrameWalk) -> None:
        """Record a chunk that the cut skips."""
        if step.is_canonical:
            self.last_keyframe = step.frame
            if walk.header.snapshots and step.header.kind == container.CANO:
                self.reference = walk.take(step)
        elif step.frame is None:
            self._prologue.append(walk.take(step))
        elif step.header.kind in _SIDE_DATA:
            self._latest_by_kind[step.header.kind] = walk.take(step)

    def chunks(self) -> list[Chunk]:
        """Return the chunks to write before the first frame, in stream order."""
        return self._prologue + sorted(
            self._latest_by_kind.values(), key=lambda chunk: chunk.sequence
        )


def _find_first(
    steps: Iterator[Step], start: int | None, walk: FrameWalk, skipped: _SkippedFrames
) -> Step:
    """Find the first requested frame; `skipped` collects the chunks before it."""
    for step in steps:
        if step.is_frame and (start is None or (step.frame or 0) >= start):
            if start is None or (step.is_canonical and step.frame == start):
                return step
            _raise_no_keyframe(start, skipped.last_keyframe, step, steps)
        skipped.add(step, walk)
    hint = _describe_nearest_keyframes(skipped.last_keyframe, None)
    message = f"the stream has no {'frames' if start is None else f'frame {start}'}{hint}"
    raise EditError(message)


def _raise_no_keyframe(
    start: int, previous_keyframe: int | None, step: Step, steps: Iterator[Step]
) -> NoReturn:
    """Raise an EditError that names the keyframes before and after a frame."""
    next_keyframe = step.frame if step.is_canonical else None
    with suppress(TruncatedError):
        next_keyframe = next_keyframe or next(
            (later.frame for later in steps if later.is_canonical), None
        )
    problem = f"frame {start} is not a keyframe, so a stream cannot begin with it"
    if step.frame != start:
        problem = f"the stream has no frame {start}"
    raise EditError(problem + _describe_nearest_keyframes(previous_keyframe, next_keyframe))


class _ChunkCopier:
    """Writes chunks unchanged, but recodes snapshots whose CANO is not part of the cut.

    Args:
        writer: Writer of the new stream.
        walk: Walk over the original stream.
        reference: The last CANO before the cut, if snapshots may refer to it.
    """

    def __init__(self, writer: StreamWriter, walk: FrameWalk, reference: Chunk | None) -> None:
        self._writer, self._walk, self._reference = writer, walk, reference
        self._rebaser: SnapshotRebaser | None = None
        self._held_chunks: list[Chunk] = []

    def copy(self, step: Step) -> None:
        """Write the chunk of a step; hold it until the next frame if it is not a frame."""
        chunk = self._walk.take(step)
        if not step.is_frame:
            self._held_chunks.append(chunk)
            return
        self.write_held_chunks()
        if chunk.kind == container.CANO:
            self._reference = None
        elif chunk.kind == container.SNAP and self._reference is not None:
            self._rebaser = self._rebaser or SnapshotRebaser(self._walk.header, self._reference)
            chunk = self._rebaser.recode(chunk)
        self._writer.write(chunk.kind, chunk.payload)

    def drop_side_data(self) -> None:
        """Drop the held cameras and metadata, because they apply to frames after the cut."""
        self._held_chunks = [chunk for chunk in self._held_chunks if chunk.kind not in _SIDE_DATA]

    def write_held_chunks(self) -> None:
        """Write the held chunks."""
        for chunk in self._held_chunks:
            self._writer.write(chunk.kind, chunk.payload)
        self._held_chunks = []


def _describe_nearest_keyframes(previous_keyframe: int | None, next_keyframe: int | None) -> str:
    keyframes = [str(frame) for frame in (previous_keyframe, next_keyframe) if frame is not None]
    if not keyframes:
        return ""
    subject = "keyframes are" if len(keyframes) > 1 else "keyframe is"
    return f"; the nearest {subject} {' and '.join(keyframes)}"
