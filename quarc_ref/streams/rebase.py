"""Recodes snapshots whose CANO was removed, relative to another CANO or as a CANO.

States remain bit-identical (SPEC 7.9), because snapshots and CANOs have the same order of
Gaussians.
"""

from dataclasses import replace

import numpy as np

from quarc_ref.decoder.frames import read_checked, read_checked_snapshot
from quarc_ref.format import container, wire
from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.gaussian_planes import sort_canonical, write_canonical
from quarc_ref.format.coding.snapshot_planes import Snapshot, write_snapshot
from quarc_ref.format.container import Chunk
from quarc_ref.format.records import CanonicalChunk, Gaussians, SnapshotChunk, StreamHeader


class Rebase:
    """Recodes the snapshots of one removed CANO, in stream order.

    Args:
        header: Header of the stream.
        canonical: The removed CANO.

    Raises:
        BitstreamError: The CANO is invalid.
    """

    def __init__(self, header: StreamHeader, canonical: Chunk) -> None:
        parsed = wire.parse_canonical(canonical.payload)
        self._header = header
        self._before = read_checked(header, parsed)
        self._after: tuple[int, Snapshot] | None = None

    def take(self, chunk: Chunk) -> Chunk:
        """Return the chunk that replaces a snapshot.

        Returns:
            A CANO for the first snapshot, and if a SNAP would change the order; otherwise a SNAP.

        Raises:
            BitstreamError: The snapshot is invalid.
        """
        parsed = wire.parse_snapshot(chunk.payload)
        snapshot = read_checked_snapshot(self._header, parsed, self._before)
        if self._after is not None:
            frame, first = self._after
            coded = write_snapshot(first.gaussians, snapshot.gaussians, _relate(first, snapshot))
            if _equal(coded.gaussians, snapshot.gaussians):
                names = ("newborn_count", "origin", "axis_bits", "survivors", "sections")
                said = {name: getattr(coded, name) for name in names}
                again = replace(parsed, canonical=frame, **said)
                return replace(chunk, payload=wire.build_snapshot(again))
        self._after = parsed.frame, snapshot
        payload = wire.build_canonical(_as_canonical(parsed, snapshot.gaussians))
        return replace(chunk, kind=container.CANO, payload=payload)


def _relate(first: Snapshot, later: Snapshot) -> Int64:
    """Return the `[N]` index in the first snapshot of each Gaussian of a later one, or -1."""
    known = max(first.roots.max(initial=-1), later.roots.max(initial=-1)) + 1
    places = np.full(known + 1, -1, dtype=np.int64)  # the last entry is for index -1
    (since,) = np.nonzero(first.roots >= 0)
    places[first.roots[since]] = since
    return places[later.roots]


def _as_canonical(parsed: SnapshotChunk, gaussians: Gaussians) -> CanonicalChunk:
    origin, axis_bits, ordered = sort_canonical(gaussians)
    sections = write_canonical(ordered, origin)
    return CanonicalChunk(
        parsed.frame, ordered.count, origin, axis_bits, sections, parsed.state_crc
    )


def _equal(one: Gaussians, other: Gaussians) -> bool:
    names = ("positions", "rotations", "codes")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)
