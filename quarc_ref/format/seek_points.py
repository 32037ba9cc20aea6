"""The seek points of a stream, from INDX: SPEC 5.9."""

from collections.abc import Iterable, Sequence
from dataclasses import astuple
from typing import TypeAlias, overload

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.records import SeekPoint

Rows: TypeAlias = NDArray[np.void]
ROW = np.dtype([("offset", np.uint64), ("sequence", np.uint32), ("frame", np.uint32)])


class SeekPoints(Sequence[SeekPoint]):
    """Seek points in the order of the stream.

    They are stored as rows of an array and converted to records on access, because there
    may be millions.

    Args:
        rows: `[n]` offset, sequence number and ordinal, named as in `SeekPoint`.
    """

    def __init__(self, rows: Rows) -> None:
        self.rows = rows

    @classmethod
    def of(cls, points: Iterable[SeekPoint]) -> "SeekPoints":
        """Make seek points from records."""
        return cls(np.array([astuple(point) for point in points], dtype=ROW))

    def followed_by(self, points: Iterable[SeekPoint]) -> "SeekPoints":
        """Concatenate these seek points and others."""
        return SeekPoints(np.concatenate([self.rows, SeekPoints.of(points).rows]))

    def until(self, frame: int) -> "SeekPoints":
        """Return the seek points up to a frame."""
        return SeekPoints(self.rows[self.rows["frame"] <= frame])

    def at(self, offset: int) -> SeekPoint | None:
        """Return the seek point whose chunk starts at an offset, or None."""
        (places,) = np.nonzero(self.rows["offset"] == offset)
        return self[int(places[0])] if places.size else None

    def of_frame(self, frame: int) -> SeekPoint | None:
        """Return the seek point of a frame, or None."""
        (places,) = np.nonzero(self.rows["frame"] == frame)
        return self[int(places[0])] if places.size else None

    def __len__(self) -> int:
        return len(self.rows)

    @overload
    def __getitem__(self, place: int) -> SeekPoint: ...

    @overload
    def __getitem__(self, place: slice) -> "SeekPoints": ...

    def __getitem__(self, place: int | slice) -> "SeekPoint | SeekPoints":
        if isinstance(place, slice):
            return SeekPoints(self.rows[place])
        return SeekPoint(*self.rows[place].item())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SeekPoints) and np.array_equal(self.rows, other.rows)

    __hash__ = None  # type: ignore[assignment]  # arrays have none
