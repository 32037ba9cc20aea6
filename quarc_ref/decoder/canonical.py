"""Initializes the state of a canonical frame: SPEC 7.2."""

import numpy as np

from quarc_ref.decoder.ranges import narrow_codes, narrow_positions
from quarc_ref.decoder.rotation import expand_rotations
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.state import State
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.constants import RECENCY_LIMIT
from quarc_ref.format.records import Gaussians, StreamHeader


def begin_canonical(header: StreamHeader, frame: int, gaussians: Gaussians) -> State:
    """Return the state of a canonical frame (SPEC 7.2).

    Args:
        header: Header of the stream.
        frame: Ordinal of the frame.
        gaussians: Coded Gaussians in quantization steps, ordered by id.

    Raises:
        StateError: A position, a code or a rotation is out of range.
    """
    count = gaussians.count
    scene = Scene(
        header,
        frame,
        0,
        np.arange(count, dtype=np.int64),
        narrow_positions(gaussians.positions * header.position_step),  # [7.2-3]
        expand_rotations(gaussians.rotations, header.rotation_bits),  # [7.2-5] [7.2-6]
        narrow_codes(gaussians.codes),  # [7.2-4]
    )
    motion = np.zeros((header.symbol_planes, count), dtype=np.int16)
    recency = np.full(count, RECENCY_LIMIT, dtype=np.int16) if header.updates else None
    no_counts = ContextCounts()
    return State(scene, motion, (), None, None, count, no_counts, no_counts, no_counts, recency)
