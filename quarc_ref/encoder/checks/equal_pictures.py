"""Finds cameras that show the same picture, because one file is a copy of another."""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.findings import Finding

_MAX_DIFFERENCE = 0.5  # levels, between pictures that were compressed differently
_MIN_CONTRAST = 8  # levels; pictures with less are those of covered lenses, or black frames
_COLUMNS = 32

Thumbnail = NDArray[np.float64]


def make_thumbnail(gray: NDArray[np.float32]) -> Thumbnail:
    """Downscale a gray picture to about `_COLUMNS` columns by averaging blocks."""
    square_size = max(1, min(gray.shape[1] // _COLUMNS, gray.shape[0]))
    rows, columns = gray.shape[0] // square_size, gray.shape[1] // square_size
    squares = gray[: rows * square_size, : columns * square_size].reshape(
        rows, square_size, columns, square_size
    )
    return np.asarray(squares.mean(axis=(1, 3)), dtype=np.float64)


def is_blank(thumbnail: Thumbnail) -> bool:
    """Return whether a picture shows nothing."""
    return bool(np.ptp(thumbnail) < _MIN_CONTRAST)


def find_equal_pictures(names: Sequence[str], thumbnails: Sequence[Thumbnail]) -> Iterator[Finding]:
    """Yield a finding for every pair of cameras that show the same picture.

    Args:
        names: Names of the cameras.
        thumbnails: Thumbnail of each camera's picture, from `make_thumbnail`.
    """
    for pair in combinations(range(len(names)), 2):
        first, second = (thumbnails[index] for index in pair)
        if first.shape == second.shape and np.abs(first - second).max() < _MAX_DIFFERENCE:
            camera_names = names[pair[0]], names[pair[1]]
            message = (
                f"{camera_names[0]} and {camera_names[1]} show the same picture, so one file "
                "is a copy of the other: use the right file for each camera"
            )
            yield Finding("same-pictures", message, camera_names)
