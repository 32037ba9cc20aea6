"""A scene at one time as flat arrays for kernels."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quarc_ref.synth.paints import Paint
from quarc_ref.synth.solids import Solid

Float64 = NDArray[np.float64]


class Stage(NamedTuple):
    """Flat arrays of a scene, in which the solids of a group are consecutive.

    Attributes:
        solids: `[S, 21]` bounding sphere of each solid (center, radius); matrix from the
            world to the shape's space, row by row; shape and `Solid.bend`; sizes.
        groups: `[G, 6]` bounding sphere of each group; its first solid, and the one after
            its last.
        paints: `[S + 6, 14]` rows from `Paint.row`: of the solids, then of the room.
        room: `[6]` minimum and maximum x, y, z of the room.
        lights: `[L, 15]` center, two half edges and color of a rectangle, then its unit normal.
        ambient: `[2, 3]` light from above and from below.
    """

    solids: Float64
    groups: Float64
    paints: Float64
    room: Float64
    lights: Float64
    ambient: Float64


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """A room and its light.

    Attributes:
        faces: `[6]` faces, as in `Stage.room`.
        paints: Paints of the faces.
        lights: `[L, 15]` lamps, as in `Stage.lights`.
        ambient: `[2, 3]` ambient light, as in `Stage.ambient`.
    """

    faces: Float64
    paints: tuple[Paint, ...]
    lights: Float64
    ambient: Float64


def pack_stage(groups: Sequence[Sequence[Solid]], room: Room) -> Stage:
    """Pack groups of solids in a room into flat arrays."""
    solids = [solid for group in groups for solid in group]
    rows = np.stack([_row(solid) for solid in solids])
    ends = np.cumsum([len(group) for group in groups])
    starts = ends - [len(group) for group in groups]
    around = [_around(rows[first:last, :4]) for first, last in zip(starts, ends, strict=True)]
    return Stage(
        solids=rows,
        groups=np.column_stack((np.stack(around), starts, ends)),
        paints=np.stack([paint.row() for paint in (*(s.paint for s in solids), *room.paints)]),
        room=room.faces,
        lights=room.lights,
        ambient=room.ambient,
    )


def _row(solid: Solid) -> Float64:
    inverse = np.linalg.inv(solid.matrix)[:3].ravel()
    return np.array([*solid.bounds(), *inverse, solid.shape, solid.bend, *solid.sizes])


def _around(spheres: Float64) -> Float64:
    """Return a bounding sphere of spheres."""
    low = (spheres[:, :3] - spheres[:, 3:]).min(axis=0)
    high = (spheres[:, :3] + spheres[:, 3:]).max(axis=0)
    center = (low + high) / 2
    reach = np.linalg.norm(spheres[:, :3] - center, axis=1) + spheres[:, 3]
    return np.array([*center, reach.max()])
