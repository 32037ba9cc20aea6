"""Compresses the symbols of a stream with general-purpose compressors.

Each frame is compressed separately, as in the stream. Motion, updates and births of a frame are
separate blocks; a canonical frame and a snapshot are a single block each. A block consists of rows
of numbers; each row uses the narrowest signed integer type that can hold its numbers.
"""

import lzma
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.format import container, wire
from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.gaussian_planes import read_canonical
from quarc_ref.format.coding.snapshot_planes import Snapshot, compute_differences, read_snapshot
from quarc_ref.format.records import Births, Gaussians
from quarc_ref.format.updates import Updates
from quarc_ref.streams.chunk_reader import ChunkReader
from quarc_ref.streams.source import as_source

Kind = str
Compressor = Callable[[bytes], bytes]

_FLOAT_BYTES = 4
_ANCHOR_FLOATS = 7  # translation and quaternion
_POSE_FLOATS = 7  # position and quaternion of a Gaussian


@dataclass(frozen=True, slots=True, eq=False)
class FrameSymbols:
    """The integers that are coded in a frame.

    Attributes:
        canonical: Gaussians of a canonical frame; None in other frames.
        snapshot: A snapshot and the Gaussians of the CANO to which it refers; None in other frames.
        motion: `[c, a]` symbols of each level, level 1 first; empty in a canonical frame.
        updates: Updates of the frame; None in a canonical frame.
        births: Births of the frame; None in a canonical frame.
    """

    canonical: Gaussians | None
    snapshot: tuple[Snapshot, Gaussians] | None
    motion: tuple[Int64, ...]
    updates: Updates | None
    births: Births | None


def read_symbols(data: bytes) -> Iterator[FrameSymbols]:
    """Yield the symbols of every frame of a stream.

    Raises:
        BitstreamError: The stream is malformed.
    """
    reader, decoder = ChunkReader(as_source(data)), StreamDecoder()
    while (chunk := reader.read_chunk()) is not None:
        state = decoder.push(chunk)
        if state is None:
            continue
        gaussians = snapshot = None
        if chunk.kind == container.CANO:
            plane_count = state.scene.header.code_planes
            gaussians = read_canonical(wire.parse_canonical(chunk.payload), plane_count)
        elif chunk.kind == container.SNAP and decoder.reference is not None:
            canonical = decoder.reference.gaussians
            snapshot = read_snapshot(wire.parse_snapshot(chunk.payload), canonical), canonical
        yield FrameSymbols(gaussians, snapshot, state.symbols, state.updates, state.births)


def pack_rows(rows: Iterable[Int64]) -> bytes:
    """Return the bytes of the rows; each row uses the narrowest signed type that can hold it."""
    return b"".join(_convert_to_narrowest_type(row).tobytes() for row in rows)


def pack_frame(frame: FrameSymbols) -> dict[Kind, bytes]:
    """Return the blocks of a frame by kind; empty blocks are left out."""
    blocks = {}
    if frame.canonical is not None:
        blocks["canonical"] = pack_rows(_list_rows(frame.canonical))
    if frame.snapshot is not None:
        blocks["snapshots"] = _pack_snapshot(*frame.snapshot)
    if frame.motion:
        blocks["motion"] = pack_rows(np.concatenate(frame.motion, axis=1))
    if frame.updates is not None and frame.updates.count:
        updates = frame.updates
        indices = np.diff(updates.gaussians, prepend=0)
        residuals = updates.residuals[:, ~updates.dies]
        blocks["updates"] = pack_rows([indices, updates.dies.astype(np.int64), *residuals])
    if frame.births is not None and frame.births.newborn.count:
        rows = [np.diff(frame.births.parents, prepend=0), *_list_rows(frame.births.newborn)]
        blocks["births"] = pack_rows(rows)
    return blocks


def sum_compressed_bytes(frames: Iterable[FrameSymbols], compress: Compressor) -> dict[Kind, int]:
    """Return the total size of the compressed blocks of all frames in bytes, by kind."""
    sizes: Counter[Kind] = Counter()
    for frame in frames:
        sizes.update({kind: len(compress(block)) for kind, block in pack_frame(frame).items()})
    return dict(sizes)


def sum_float_bytes(frames: Iterable[FrameSymbols]) -> dict[Kind, int]:
    """Return the size of all symbols as raw float32 in bytes, by kind.

    A Gaussian with SH of degree 1 has 23 numbers, and an update that does not delete its Gaussian
    has 13. An anchor has 7 numbers, even if the stream does not code the w component of its
    rotation.
    """
    sizes: Counter[Kind] = Counter()
    for frame in frames:
        if frame.canonical is not None:
            sizes["canonical"] += _count_float_bytes(frame.canonical)
        if frame.snapshot is not None:
            sizes["snapshots"] += _count_float_bytes(frame.snapshot[0].gaussians)
        anchors = sum(level.shape[1] for level in frame.motion)
        sizes["motion"] += _FLOAT_BYTES * _ANCHOR_FLOATS * anchors
        if frame.updates is not None:
            sizes["updates"] += _FLOAT_BYTES * frame.updates.residuals[:, ~frame.updates.dies].size
        if frame.births is not None:
            sizes["births"] += _count_float_bytes(frame.births.newborn)
    return dict(sizes)


def compress_lzma(block: bytes) -> bytes:
    """Return a block compressed like `xz -9e`, in the container format with the least overhead."""
    return lzma.compress(block, format=lzma.FORMAT_ALONE, preset=9 | lzma.PRESET_EXTREME)


def compress_zstd(block: bytes) -> bytes:
    """Return a block compressed like `zstd -19`, but without checksum and content size.

    Raises:
        ImportError: The package `zstandard` is not installed.
    """
    import zstandard

    compressor = zstandard.ZstdCompressor(level=19, write_content_size=False)
    compressed: bytes = compressor.compress(block)
    return compressed


COMPRESSORS: dict[str, Compressor] = {"zstd-19": compress_zstd, "lzma-9e": compress_lzma}


def _list_rows(gaussians: Gaussians) -> list[Int64]:
    return [*gaussians.positions, *gaussians.rotations, *gaussians.codes]


def _pack_snapshot(snapshot: Snapshot, canonical: Gaussians) -> bytes:
    """Pack which Gaussians of the CANO survive, their differences, and the new Gaussians."""
    lives = np.zeros(canonical.count, dtype=np.int64)
    lives[snapshot.canonical_indices[snapshot.canonical_indices >= 0]] = 1
    new_indices = np.flatnonzero(snapshot.canonical_indices < 0)
    new_rows = [row[new_indices] for row in _list_rows(snapshot.gaussians)]
    return pack_rows([lives, *compute_differences(snapshot, canonical), *new_rows])


def _count_float_bytes(gaussians: Gaussians) -> int:
    return _FLOAT_BYTES * (_POSE_FLOATS + len(gaussians.codes)) * gaussians.count


def _convert_to_narrowest_type(row: Int64) -> np.ndarray:
    """Return a row as little-endian integers of the smallest size that fits: 1, 2, 4 or 8 bytes."""
    low, high = int(row.min(initial=0)), int(row.max(initial=0))
    types = [np.dtype(name) for name in ("<i1", "<i2", "<i4", "<i8")]
    fitting_types = [
        dtype for dtype in types if np.iinfo(dtype).min <= low and high <= np.iinfo(dtype).max
    ]
    return row.astype(fitting_types[0])
