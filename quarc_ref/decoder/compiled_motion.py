"""Deaths and motion by `motion_kernels`: what `reconstruct` does in NumPy, to the bit."""

from types import ModuleType

import numpy as np

from quarc_ref.decoder.anchors import Anchors
from quarc_ref.decoder.scene import Scene, make_planes, whole
from quarc_ref.format.acceleration import count_threads, map_parts
from quarc_ref.format.arrays import Int16, Int32, Int64
from quarc_ref.format.constants import POSITION_LIMIT
from quarc_ref.format.errors import DegenerateRotationError, PositionRangeError

_PARTS_OF_A_THREAD = 4


def move_through(
    kernels: ModuleType, scene: Scene, anchors: Anchors, symbols: list[Int64], room: int = 0
) -> tuple[Int32, Int32, Int16]:
    """Move every Gaussian by its anchors (SPEC 7.5).

    Args:
        kernels: Those of `motion_kernels`.
        scene: Before the motion.
        anchors: Of the frame.
        symbols: `[c, a]` of each level, level 1 first.
        room: How many columns more there are to be behind each plane.

    Returns:
        The positions and rotations after it, and the motion `[c, N]`.

    Raises:
        PositionRangeError: A Gaussian leaves the lattice.
        DegenerateRotationError: A sum of residuals is zero.
    """
    header = scene.header
    packed = _pack(kernels, symbols)
    steps = (
        header.translation_step,
        header.rotation_unity * header.level_count,
        POSITION_LIMIT,
    )
    positions = make_planes(3, scene.count, room, np.int32)
    rotations = make_planes(4, scene.count, room, np.int32)
    motion = make_planes(header.symbol_planes, scene.count, room, np.int16)
    after = (whole(positions, room), whole(rotations, room), whole(motion, room))
    before = (scene.positions, scene.rotations)
    parts = _PARTS_OF_A_THREAD * count_threads()
    borders = [scene.count * part // parts for part in range(parts + 1)]

    def move_part(part: int) -> tuple[bool, bool]:
        span = (borders[part], borders[part + 1])
        found: tuple[bool, bool] = kernels.move(before, anchors.binding, packed, steps, span, after)
        return found

    found = map_parts(move_part, range(parts))
    if any(leaves for leaves, _ in found):
        message = "a Gaussian leaves the lattice"
        raise PositionRangeError(message)
    if any(degenerate for _, degenerate in found):
        message = "a rotation has norm zero"
        raise DegenerateRotationError(message)
    return positions, rotations, motion


def _pack(kernels: ModuleType, symbols: list[Int64]) -> tuple[object, ...]:
    """Return the symbols of all levels as the kernels take them, and where levels begin."""
    borders = np.cumsum([0, *(level.shape[1] for level in symbols)])
    packed = np.empty((borders[-1], 2), dtype=np.int64)
    for first, level in zip(borders.tolist(), symbols, strict=False):
        kernels.pack_symbols(np.ascontiguousarray(level), packed, first)
    return packed, borders[:-1]
