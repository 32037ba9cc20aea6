"""The seek points of a stream, from INDX: SPEC 5.9."""

from collections.abc import Iterable, Sequence
from dataclasses import astuple
from typing import TypeAlias, overload

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.records import SeekPoint

Rows: TypeAlias = NDArray[np.void]
ROW_DTYPE = np.dtype([("offset", np.uint64), ("sequence", np.uint32), ("frame", np.uint32)])


class SeekPoints(Sequence[SeekPoint]):
    """Seek points in the order of the stream.

    Because there may be millions of them, they are stored as rows of an array and converted to
    records on access.

    Args:
        rows: `[n]` structured array with the fields of `SeekPoint`.
    """

    def __init__(self, rows: Rows) -> None:
        self.rows = rows

    @classmethod
    def from_records(cls, points: Iterable[SeekPoint]) -> "SeekPoints":
        """Convert records to seek points."""
        return cls(np.array([astuple(point) for point in points], dtype=ROW_DTYPE))

    def with_appended(self, points: Iterable[SeekPoint]) -> "SeekPoints":
        """Return these seek points followed by `points`."""
        return SeekPoints(np.concatenate([self.rows, SeekPoints.from_records(points).rows]))

    def up_to_frame(self, frame: int) -> "SeekPoints":
        """Return the seek points up to and including a frame."""
        return SeekPoints(self.rows[self.rows["frame"] <= frame])

    def find_by_offset(self, offset: int) -> SeekPoint | None:
        """Return the seek point whose chunk starts at an offset, or None."""
        (indices,) = np.nonzero(self.rows["offset"] == offset)
        return self[int(indices[0])] if indices.size else None

    def find_by_frame(self, frame: int) -> SeekPoint | None:
        """Return the seek point of a frame, or None."""
        (indices,) = np.nonzero(self.rows["frame"] == frame)
        return self[int(indices[0])] if indices.size else None

    def __len__(self) -> int:
        return len(self.rows)

    @overload
    def __getitem__(self, index: int) -> SeekPoint: ...

    @overload
    def __getitem__(self, index: slice) -> "SeekPoints": ...

    def __getitem__(self, index: int | slice) -> "SeekPoint | SeekPoints":
        if isinstance(index, slice):
            return SeekPoints(self.rows[index])
        return SeekPoint(*self.rows[index].item())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SeekPoints) and np.array_equal(self.rows, other.rows)

    __hash__ = None  # type: ignore[assignment]  # arrays have no hash
