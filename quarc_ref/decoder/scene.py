"""The integer state of a frame: SPEC 7.1.

Planes come first, `[3, N]` and not `[N, 3]`: in that order the state is
serialized, hashed and coded.
"""

from dataclasses import dataclass
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.acceleration import Wait, load_kernels, settled, start_parts
from quarc_ref.format.arrays import Int16, Int32, Int64
from quarc_ref.format.records import StreamHeader

MOTION_KERNELS: Final = "quarc_ref.decoder.motion_kernels"

_Number = TypeVar("_Number", np.int16, np.int32, np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """One decoded frame. Gaussians stand in the order of their ids.

    Attributes:
        header: What the stream chose for itself.
        frame: Ordinal of the frame in the stream.
        phase: Frames since the canonical one, 0 there.
        ids: `[N]` ascending: 0 to N - 1 in the canonical frame, then counted on by birth.
        positions: `[3, N]` xyz in lattice units, magnitudes below 2^23.
        rotations: `[4, N]` unit quaternions wxyz, Q22.
        codes: `[code_planes, N]` log-scale 3, opacity logit 1, SH DC 3, SH rest 9.
    """

    header: StreamHeader
    frame: int
    phase: int
    ids: Int64
    positions: Int32
    rotations: Int32
    codes: Int16

    def __post_init__(self) -> None:
        planes = (
            ("positions", 3, np.int32),
            ("rotations", 4, np.int32),
            ("codes", self.header.code_planes, np.int16),
        )
        for name, rows, kind in planes:
            array, shape = getattr(self, name), (rows, self.count)
            if array.shape != shape or array.dtype != kind:
                message = f"{name} is {array.dtype}{array.shape}, not {kind.__name__}{shape}"
                raise ValueError(message)

    @property
    def count(self) -> int:
        """Number of Gaussians, N."""
        return int(self.ids.size)

    def without(self, gone: Int64, room: int = 0) -> "tuple[Scene, Wait]":
        """Return the scene without the Gaussians of ascending indices `[g]`; order is kept.

        Args:
            gone: Which.
            room: Behind the ids and each plane of codes: see `append`.

        Returns:
            The scene, and what waits for its rotations and codes, which other threads
            may still write.
        """
        positions, wait_for_positions = start_removing(self.positions, gone)
        rotations, wait_for_rotations = start_removing(self.rotations, gone)
        codes, wait_for_codes = start_removing(self.codes, gone, room)
        ids = remove(self.ids[None], gone, room)[0]
        scene = Scene(self.header, self.frame, self.phase, ids, positions, rotations, codes)
        wait_for_positions()
        return scene, lambda: (wait_for_rotations(), wait_for_codes())


def remove(planes: NDArray[_Number], gone: Int64, room: int = 0) -> NDArray[_Number]:
    """Return planes `[r, N]` without the columns of ascending indices `[g]`.

    Where there are none, and no room is wanted, these are the planes themselves.

    Args:
        planes: Of any kind.
        gone: Which columns.
        room: How many columns more there are to be behind those, for `append`.
    """
    if gone.size == room == 0:
        return planes
    kept = make_planes(planes.shape[0], planes.shape[1] - gone.size, room, planes.dtype)
    _keep_others(planes, gone, kept, room)
    return kept


def start_removing(
    planes: NDArray[_Number], gone: Int64, room: int = 0
) -> tuple[NDArray[_Number], Wait]:
    """Do as `remove`; return what waits, too, until other threads have written the planes."""
    if gone.size == room == 0:
        return planes, settled
    kept = make_planes(planes.shape[0], planes.shape[1] - gone.size, room, planes.dtype)
    return kept, start_parts(lambda to: _keep_others(planes, gone, to, room), [kept])


def _keep_others(planes: NDArray[_Number], gone: Int64, kept: NDArray[_Number], room: int) -> None:
    kernels = load_kernels(MOTION_KERNELS, planes.shape[1])
    if kernels is None:
        kept[:] = np.delete(planes, gone, axis=1)
    else:
        kernels.remove(planes, gone, whole(kept, room))


def make_planes(
    rows: int, columns: int, room: int, kind: type[_Number] | np.dtype[_Number]
) -> NDArray[_Number]:
    """Return planes `[rows, columns]` to be written, and behind them room for `append`."""
    return np.empty((rows, columns + room), dtype=kind)[:, :columns]


def whole(planes: NDArray[_Number], room: int) -> NDArray[_Number]:
    """Return planes with the room behind them, both in one piece."""
    with_room: NDArray[_Number] | None = planes.base
    return planes if room == 0 or with_room is None else with_room


def append(planes: NDArray[_Number], columns: NDArray[_Number], room: int) -> NDArray[_Number]:
    """Return planes `[r, N]` with columns `[r, n]` behind them.

    Args:
        planes: They stay as they are.
        columns: What the room behind the planes, if any, was made for; once.
        room: How many columns that is, n or none.
    """
    if room == 0:
        return np.hstack([planes, columns])
    grown = whole(planes, room)
    grown[:, planes.shape[1] :] = columns
    return grown
