"""Summarizes the contents of a stream: counts, bytes by kind, and estimated bytes.

The whole stream is decoded, which verifies its CRCs and states.
"""

from collections.abc import Callable
from contextlib import suppress

from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.engine import FrameState
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.format import container, wire
from quarc_ref.format.coding.gaussian_planes import read_canonical
from quarc_ref.format.coding.snapshot_planes import read_snapshot
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import BitstreamError
from quarc_ref.inspection.estimate import (
    estimate_births,
    estimate_gaussians,
    estimate_motion,
    estimate_snapshot,
    estimate_updates,
)
from quarc_ref.inspection.stream_summary import KINDS, ChunkSummary, FrameSummary, StreamSummary
from quarc_ref.inspection.symbols import count_magnitudes
from quarc_ref.streams.chunk_reader import ChunkReader, check_payload_crc
from quarc_ref.streams.seek import read_tail_chunk
from quarc_ref.streams.source import BytesLike, Source, as_source


def count_frames(stream: BytesLike | Source) -> int:
    """Count frames without decoding: read TAIL, or the chunk headers if there is no TAIL.

    Returns:
        The number of frames; in an incomplete stream, the number of complete frames before
        the end or the first damage. If the size is unknown, as for a pipe, the number is 0.
    """
    source = as_source(stream)
    size = source.size()
    if size is None:
        return 0
    tail = read_tail_chunk(source, size)
    if tail is not None:
        return wire.parse_tail(tail.payload).frame_count
    reader, count = ChunkReader(source), 0
    with suppress(BitstreamError):
        reader.read_chunk()
        for header in reader.headers():
            if header.end > size:
                break
            count += header.kind in container.FRAME_TYPES
    return count


def inspect_stream(
    stream: BytesLike | Source, on_progress: Callable[[str, int, int], None] | None = None
) -> StreamSummary:
    """Decode a stream and summarize its contents.

    Args:
        stream: A stream, which may be a pipe.
        on_progress: Function called after every frame with the stage, the number of frames so
            far, and the total (0 if unknown).

    Raises:
        BitstreamError: The stream is invalid.
        LimitError: A stream at the unlimited level exceeds the limits of this decoder.
        SourceError: The file, pipe or server cannot be read.
    """
    source, total = as_source(stream), count_frames(stream)
    reader, decoder = ChunkReader(source), StreamDecoder()
    frames: list[FrameSummary] = []
    chunks: list[ChunkSummary] = []
    for header in reader.headers():
        size = header.end - header.offset
        chunks.append(ChunkSummary(header.kind.decode(), header.sequence, header.offset, size))
        if header.kind not in container.KNOWN_TYPES:
            check_payload_crc(source, header)
            continue
        chunk = reader.take(header)
        state = decoder.push(chunk)
        if state is None:
            continue
        frames.append(_summarize_frame(chunk, state, decoder))
        if on_progress is not None:
            on_progress("inspect", len(frames), total)
    return StreamSummary(
        decoder.header,
        decoder.cameras,
        decoder.metadata,
        reader.offset,
        tuple(frames),
        tuple(chunks),
    )


def count_coded_bytes(chunk: Chunk, *, updates: bool) -> dict[str, int]:
    """Return the number of bytes of each kind of coded planes in a frame's chunk.

    Args:
        chunk: Chunk of a frame.
        updates: Whether the stream has updates.

    Raises:
        BitstreamError: The chunk is invalid.
    """
    byte_counts = dict.fromkeys(KINDS, 0)
    if chunk.kind == container.CANO:
        sections = wire.parse_canonical(chunk.payload).sections
        byte_counts["canonical"] = sum(section.byte_count() for section in sections)
    elif chunk.kind == container.SNAP:
        snapshot = wire.parse_snapshot(chunk.payload)
        sections = (snapshot.survivors, *snapshot.sections)
        byte_counts["snapshots"] = sum(section.byte_count() for section in sections)
    else:
        frame_chunk = wire.parse_frame(chunk.payload, updates=updates)
        byte_counts["motion"], byte_counts["births"] = (
            frame_chunk.motion.byte_count(),
            frame_chunk.births.byte_count(),
        )
        byte_counts["updates"] = frame_chunk.updates.byte_count() if frame_chunk.updates else 0
    return byte_counts


def _summarize_frame(chunk: Chunk, state: FrameState, decoder: StreamDecoder) -> FrameSummary:
    scene, header = state.scene, state.scene.header
    estimate: dict[str, float] = dict.fromkeys(KINDS, 0.0)
    births = deaths = updates = 0
    if chunk.kind == container.CANO:
        canonical = wire.parse_canonical(chunk.payload)
        estimate["canonical"] = estimate_gaussians(read_canonical(canonical, header.code_planes))
    elif chunk.kind == container.SNAP and decoder.reference is not None:
        canonical_gaussians = decoder.reference.gaussians
        snapshot = read_snapshot(wire.parse_snapshot(chunk.payload), canonical_gaussians)
        estimate["snapshots"] = estimate_snapshot(snapshot, canonical_gaussians)
    else:
        frame_chunk = wire.parse_frame(chunk.payload, updates=header.updates)
        births, deaths = frame_chunk.birth_count, frame_chunk.death_count
        if state.updates is not None:
            deleted_count = int(state.updates.dies.sum())
            deaths, updates = deaths + deleted_count, state.updates.count - deleted_count
            previous_count = scene.count - births + deleted_count
            estimate["updates"] = estimate_updates(state.updates, previous_count)
        estimate["motion"] = estimate_motion(state.symbols)
        estimate["births"] = estimate_births(state.births) if state.births else 0.0
    return FrameSummary(
        scene.frame,
        chunk.kind in container.CANONICAL_TYPES,
        scene.count,
        sum(level.shape[1] for level in state.symbols),
        births,
        deaths,
        updates,
        chunk.byte_count(),
        count_coded_bytes(chunk, updates=header.updates),
        estimate,
        count_magnitudes(state.symbols),
        compute_digest(scene),
    )
