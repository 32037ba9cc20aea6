"""Reads partial streams, from which interrupted encodes are resumed.

The complete frames of a stream are sufficient to resume. The state of the last frame is decoded,
and exposures are computed from decoded frame 0. Rate-distortion weights are computed from the
frame sizes, and random numbers depend only on (seed, frame, purpose). The resumed stream is
byte-identical to that of an uninterrupted encode if capture, settings and software are the same.
To detect differences, the metadata of the stream is compared with that of the new encode.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

from quarc_ref.encoder.resume.differences import compare_metadata, make_resume_error
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.format import container, wire
from quarc_ref.format.cameras import Camera
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import BitstreamError, ResumeError, TruncatedError
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams.chunk_reader import ChunkReader
from quarc_ref.streams.resync import parse_ordinal
from quarc_ref.streams.source import Source
from quarc_ref.wording import format_count

_PROLOGUE = (container.HEAD, container.CAME, container.META)


@dataclass(frozen=True, slots=True)
class PartialStream:
    """The complete frames at the beginning of a stream.

    Attributes:
        header: Header from the HEAD chunk.
        cameras: Cameras from the `came` chunk.
        metadata: Metadata from the `meta` chunk.
        frames: Chunks of the complete frames; the first frame is canonical. If no frame is
            complete, an encode starts again.
        end: Offset of the end of the last complete frame, bytes; 0 if there is none.
        is_finished: Whether the stream ends with TAIL.
        is_damaged: Whether the bytes after the last complete frame are not those of an interrupted
            write.
    """

    header: StreamHeader
    cameras: tuple[Camera, ...]
    metadata: dict[str, str]
    frames: tuple[Chunk, ...]
    end: int
    is_finished: bool
    is_damaged: bool


def read_partial_stream(source: Source) -> PartialStream | None:
    """Read a stream up to its last complete frame.

    Bytes after the last complete frame are ignored: an interrupted write may have left them.

    Returns:
        The partial stream; None if the source ends before the first frame.

    Raises:
        BitstreamError: The source is not a stream, or a chunk before its first frame is damaged.
        ResumeError: The chunks are not in the order in which this encoder writes them.
    """
    chunks: list[Chunk] = []
    reader, is_damaged = ChunkReader(source), False
    try:
        for header in reader.headers():
            chunks.append(reader.take(header))  # noqa: PERF401, keeps the chunks before an error
    except TruncatedError:
        pass
    except BitstreamError:
        if len(chunks) < len(_PROLOGUE):
            raise
        is_damaged = True
    return _build_partial_stream(chunks, is_damaged=is_damaged)


def _build_partial_stream(chunks: Sequence[Chunk], *, is_damaged: bool) -> PartialStream | None:
    prologue_length = len(_PROLOGUE)
    prologue, other_chunks = chunks[:prologue_length], chunks[prologue_length:]
    frames = tuple(chunk for chunk in other_chunks if chunk.kind in container.FRAME_TYPES)
    unexpected_kinds = {chunk.kind for chunk in other_chunks} - {
        *container.FRAME_TYPES,
        container.INDX,
        container.TAIL,
    }
    if tuple(chunk.kind for chunk in prologue) != _PROLOGUE[: len(chunks)] or unexpected_kinds:
        message = "the chunks of the stream are not in the order in which this encoder writes them"
        raise ResumeError(message)
    if len(prologue) < prologue_length:
        return None
    return PartialStream(
        wire.parse_stream_header(prologue[0].payload),
        wire.parse_cameras(prologue[1].payload),
        wire.parse_metadata(prologue[2].payload),
        frames,
        frames[-1].offset + frames[-1].byte_count() if frames else 0,
        bool(frames) and other_chunks[-1].kind == container.TAIL,
        is_damaged,
    )


def require_match(
    partial_stream: PartialStream,
    header: StreamHeader,
    cameras: Sequence[Camera],
    metadata: dict[str, str],
) -> None:
    """Raise ResumeError unless header, cameras and metadata equal those of this encode.

    Args:
        partial_stream: The partial stream.
        header: Header of this encode, whose conformance level is ignored.
        cameras: Cameras of this encode.
        metadata: Metadata of this encode.
    """
    differences = compare_metadata(partial_stream.metadata, metadata) or [
        *(["cameras"] if partial_stream.cameras != _round_trip_cameras(cameras) else []),
        *_compare_headers(partial_stream.header, header),
    ]
    if differences:
        what = "the partial stream was encoded"
        raise make_resume_error(what, differences)


def require_frames(
    partial_stream: PartialStream, frame_count: int, canonical_settings: CanonicalSettings
) -> None:
    """Raise ResumeError unless the frames have the expected chunk types and ordinals.

    Args:
        partial_stream: The partial stream.
        frame_count: Requested number of frames.
        canonical_settings: Settings that determine the chunk type of each frame.
    """
    for frame, chunk in enumerate(partial_stream.frames):
        expected_kind = canonical_settings.frame_kind(frame)
        expected_ordinal = None if expected_kind == container.FRAM else frame
        if chunk.kind != expected_kind or _canonical_ordinal(chunk) != expected_ordinal:
            message = (
                f"frame {frame} of the stream does not match this encode, because the stream was "
                "cut or joined: resume the original stream, or encode to another file"
            )
            raise ResumeError(message)
    require_frame_count(partial_stream, frame_count)


def require_frame_count(partial_stream: PartialStream, frame_count: int) -> None:
    """Raise ResumeError if the stream has too many frames, or is complete but has too few."""
    found_count = len(partial_stream.frames)
    if found_count > frame_count or (partial_stream.is_finished and found_count < frame_count):
        state, option = "has", f"--frames {found_count} or more"
        if partial_stream.is_finished:
            state, option = "is complete with", f"--frames {found_count}"
        message = (
            f"the stream {state} {format_count(found_count, 'frame')}, but {frame_count} "
            f"{'is' if frame_count == 1 else 'are'} requested: use {option}, or encode to another "
            "file"
        )
        raise ResumeError(message)


def _canonical_ordinal(chunk: Chunk) -> int | None:
    """Return the ordinal that a CANO or SNAP chunk contains; None for other chunks."""
    return parse_ordinal(chunk.payload) if chunk.kind in container.CANONICAL_TYPES else None


def _round_trip_cameras(cameras: Sequence[Camera]) -> tuple[Camera, ...]:
    return wire.parse_cameras(wire.build_cameras(tuple(cameras)))


def _compare_headers(existing_header: StreamHeader, new_header: StreamHeader) -> list[str]:
    """Return the names of header fields that differ; the conformance level is not compared."""
    names = [field.name for field in fields(StreamHeader) if field.name != "level"]
    return [name for name in names if getattr(existing_header, name) != getattr(new_header, name)]
