"""Partial streams, from which an interrupted encode is resumed.

The complete frames of the stream are sufficient to resume: a frame depends on the
decoder's state of the previous one, random numbers on (seed, frame, purpose), exposures
on decoded frame 0, and rate-distortion weights on frame sizes. The result is
byte-identical to an uninterrupted encode if capture, settings and software are the same,
which is checked by the metadata of the stream.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.renamed import update_names
from quarc_ref.format import container, wire
from quarc_ref.format.cameras import Camera
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import BitstreamError, ResumeError, TruncatedError
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams.chunk_reader import ChunkReader
from quarc_ref.streams.resync import canonical_frame
from quarc_ref.streams.source import Source

_PROLOGUE = (container.HEAD, container.CAME, container.META)


@dataclass(frozen=True, slots=True)
class PartialStream:
    """The complete frames at the beginning of a stream.

    Attributes:
        header: Header from the HEAD chunk.
        cameras: Cameras from the `came` chunk.
        metadata: Metadata from the `meta` chunk.
        frames: Chunks of the frames; the first one is canonical.
        end: Offset of the end of the last of these chunks, bytes.
        is_finished: Whether the stream ends with TAIL.
    """

    header: StreamHeader
    cameras: tuple[Camera, ...]
    metadata: dict[str, str]
    frames: tuple[Chunk, ...]
    end: int
    is_finished: bool


def read_partial_stream(source: Source) -> PartialStream | None:
    """Read a stream up to its last complete frame.

    Bytes after it are assumed to be left from an interrupted write.

    Returns:
        The partial stream; None if there is no complete frame.

    Raises:
        BitstreamError: The bytes are not a stream.
        ResumeError: The chunks are not in the order in which this encoder writes them.
    """
    chunks: list[Chunk] = []
    reader = ChunkReader(source)
    try:
        for header in reader.headers():
            chunks.append(reader.take(header))  # noqa: PERF401, those before an error count
    except TruncatedError:
        pass
    except BitstreamError:
        if not any(chunk.kind in container.FRAME_TYPES for chunk in chunks):
            raise
    return _gather(chunks)


def _gather(chunks: Sequence[Chunk]) -> PartialStream | None:
    count = len(_PROLOGUE)
    prologue, rest = chunks[:count], chunks[count:]
    frames = tuple(chunk for chunk in rest if chunk.kind in container.FRAME_TYPES)
    foreign = {chunk.kind for chunk in rest} - {
        *container.FRAME_TYPES,
        container.INDX,
        container.TAIL,
    }
    if tuple(chunk.kind for chunk in prologue) != _PROLOGUE[: len(chunks)] or foreign:
        message = "the chunks of the stream are not in the order in which this encoder writes them"
        raise ResumeError(message)
    if not frames:
        return None
    return PartialStream(
        wire.parse_stream_header(prologue[0].payload),
        wire.parse_cameras(prologue[1].payload),
        wire.parse_metadata(prologue[2].payload),
        frames,
        frames[-1].offset + frames[-1].byte_count(),
        rest[-1].kind == container.TAIL,
    )


def require_match(
    existing: PartialStream,
    header: StreamHeader,
    cameras: Sequence[Camera],
    metadata: dict[str, str],
) -> None:
    """Raise ResumeError unless header, cameras and metadata match this encode's.

    Args:
        existing: The partial stream.
        header: Header of this encode; its conformance level is ignored.
        cameras: Cameras of this encode.
        metadata: Metadata of this encode.
    """
    differ = _compare_metadata(existing.metadata, metadata) or [
        *(["set of cameras"] if existing.cameras != _as_written(cameras) else []),
        *_compare_headers(existing.header, header),
    ]
    if differ:
        message = (
            "the partial stream was encoded with different inputs; these differ: "
            f"{', '.join(_DESCRIBED.get(name, name) for name in differ)}"
        )
        raise ResumeError(message)


_DESCRIBED = {"fingerprint": "fingerprint (of the capture's files, masks included)"}


def require_frames(existing: PartialStream, frame_count: int, canonical: CanonicalSettings) -> None:
    """Raise ResumeError unless the frames are the first ones of this encode.

    Args:
        existing: The partial stream.
        frame_count: Requested number of frames.
        canonical: Settings that determine which frames are canonical.
    """
    for frame, chunk in enumerate(existing.frames):
        due = canonical.frame_kind(frame)
        named = None if due == container.FRAM else frame
        if chunk.kind != due or _name_canonical(chunk) != named:
            message = (
                f"frame {frame} of the stream does not match this encode; the stream was cut or "
                "joined"
            )
            raise ResumeError(message)
    require_count(existing, frame_count)


def require_count(existing: PartialStream, frame_count: int) -> None:
    """Raise ResumeError if there are too many frames, or too few in a finished stream."""
    found = len(existing.frames)
    if found > frame_count or (existing.is_finished and found < frame_count):
        end = "is complete with" if existing.is_finished else "has"
        message = f"the stream {end} {found} frames, not {frame_count}"
        raise ResumeError(message)


def _name_canonical(chunk: Chunk) -> int | None:
    """Return the ordinal of a canonical frame; None for other frames."""
    return canonical_frame(chunk.payload) if chunk.kind in container.CANONICAL_TYPES else None


def _as_written(cameras: Sequence[Camera]) -> tuple[Camera, ...]:
    return wire.parse_cameras(wire.build_cameras(tuple(cameras)))


def _compare_headers(before: StreamHeader, now: StreamHeader) -> list[str]:
    """Return the names of header fields that differ, ignoring the conformance level."""
    names = [field.name for field in fields(StreamHeader) if field.name != "level"]
    return [name for name in names if getattr(before, name) != getattr(now, name)]


def _compare_metadata(before: dict[str, str], now: dict[str, str]) -> list[str]:
    """Return the names of metadata entries and settings that differ."""
    if "settings" in before:
        before = before | {"settings": update_names(before["settings"])}
    names = [name for name in {**before, **now} if before.get(name) != now.get(name)]
    if "settings" in names:
        names.remove("settings")
        said = {*before.get("settings", "").split()} ^ {*now["settings"].split()}
        names += sorted({item.partition("=")[0] for item in said if "=" in item}) or ["settings"]
    return names
