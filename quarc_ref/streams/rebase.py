"""Recodes snapshots whose CANO was removed, either relative to another CANO or as a CANO.

States stay bit-identical (SPEC 7.9), because snapshots and CANOs have the same order of
Gaussians.
"""

from dataclasses import replace

import numpy as np

from quarc_ref.decoder.frames import read_checked_canonical, read_checked_snapshot
from quarc_ref.format import container, wire
from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.gaussian_planes import sort_canonical, write_canonical
from quarc_ref.format.coding.snapshot_planes import Snapshot, write_snapshot
from quarc_ref.format.container import Chunk
from quarc_ref.format.records import CanonicalChunk, Gaussians, SnapshotChunk, StreamHeader


class SnapshotRebaser:
    """Recodes the snapshots that refer to a removed CANO, in stream order.

    Args:
        header: Header of the stream.
        canonical: The removed CANO.

    Raises:
        BitstreamError: The CANO is invalid.
    """

    def __init__(self, header: StreamHeader, canonical: Chunk) -> None:
        parsed = wire.parse_canonical(canonical.payload)
        self._header = header
        self._removed_gaussians = read_checked_canonical(header, parsed)
        self._new_canonical: tuple[int, Snapshot] | None = None

    def recode(self, chunk: Chunk) -> Chunk:
        """Recode a snapshot.

        Args:
            chunk: A SNAP chunk that refers to the removed CANO.

        Returns:
            The chunk that replaces the snapshot. It is a CANO for the first snapshot and when a
            SNAP would change the order of the Gaussians; otherwise it is a SNAP.

        Raises:
            BitstreamError: The snapshot is invalid.
        """
        parsed = wire.parse_snapshot(chunk.payload)
        snapshot = read_checked_snapshot(self._header, parsed, self._removed_gaussians)
        if self._new_canonical is not None:
            frame, first = self._new_canonical
            coded = write_snapshot(
                first.gaussians, snapshot.gaussians, _match_gaussians(first, snapshot)
            )
            if _are_equal(coded.gaussians, snapshot.gaussians):
                names = ("newborn_count", "origin", "axis_bits", "survivors", "sections")
                coded_fields = {name: getattr(coded, name) for name in names}
                recoded = replace(parsed, canonical=frame, **coded_fields)
                return replace(chunk, payload=wire.build_snapshot(recoded))
        self._new_canonical = parsed.frame, snapshot
        payload = wire.build_canonical(_build_canonical(parsed, snapshot.gaussians))
        return replace(chunk, kind=container.CANO, payload=payload)


def _match_gaussians(first: Snapshot, later: Snapshot) -> Int64:
    """Return the `[N]` index of each Gaussian of `later` in `first`; -1 for new Gaussians."""
    index_count = (
        max(first.canonical_indices.max(initial=-1), later.canonical_indices.max(initial=-1)) + 1
    )
    indices = np.full(index_count + 1, -1, dtype=np.int64)  # the last entry is for index -1
    (survivors,) = np.nonzero(first.canonical_indices >= 0)
    indices[first.canonical_indices[survivors]] = survivors
    return indices[later.canonical_indices]


def _build_canonical(parsed: SnapshotChunk, gaussians: Gaussians) -> CanonicalChunk:
    origin, axis_bits, ordered = sort_canonical(gaussians)
    sections = write_canonical(ordered, origin)
    return CanonicalChunk(
        parsed.frame, ordered.count, origin, axis_bits, sections, parsed.state_crc
    )


def _are_equal(first: Gaussians, second: Gaussians) -> bool:
    names = ("positions", "rotations", "codes")
    return all(np.array_equal(getattr(first, name), getattr(second, name)) for name in names)
