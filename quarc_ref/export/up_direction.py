"""Reads and writes the metadata key `up`: an up direction that is not along an axis (SPEC I.4)."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

UP_KEY = "up"


def find_up_direction(up_axis: int, metadata: Mapping[str, str]) -> NDArray[np.float64] | None:
    """Return the `[3]` up direction of a stream; None if the stream does not state it.

    Args:
        up_axis: Up axis from the stream's header, which precedes the metadata.
        metadata: Metadata of the stream.
    """
    if up_axis:
        axis_index, is_negative = divmod(up_axis - 1, 2)
        axis: NDArray[np.float64] = np.eye(3)[axis_index] * (-1 if is_negative else 1)
        return axis
    try:
        direction = np.array([float(number) for number in metadata.get(UP_KEY, "").split()])
    except ValueError:
        return None
    is_valid = direction.shape == (3,) and np.isfinite(direction).all() and direction.any()
    return direction if is_valid else None


def format_up_direction(direction: Sequence[float] | NDArray[np.float64]) -> str:
    """Format an up direction as the value of the metadata key `up`."""
    return " ".join(f"{number:.6f}" for number in direction)
