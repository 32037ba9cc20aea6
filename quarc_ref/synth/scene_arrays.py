"""A scene at a point in time, as flat arrays for kernels."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quarc_ref.synth.paints import Paint
from quarc_ref.synth.solids import Solid

Float64 = NDArray[np.float64]


class SceneArrays(NamedTuple):
    """Flat arrays of a scene, in which the solids of a group are consecutive.

    Attributes:
        solids: `[S, 21]` bounding sphere of each solid (center, radius); matrix from the
            world to the shape's space, row by row; shape; `Solid.parameter`; sizes.
        groups: `[G, 6]` bounding sphere of each group; index of its first solid; end index
            (exclusive) of its solids.
        paints: `[S + 6, 14]` rows from `Paint.as_row`: paints of the solids, then of the room.
        room: `[6]` minimum and maximum x, y, z of the room.
        lights: `[L, 15]` rectangular lamps: center, vectors of two half edges, color, unit normal.
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
    """A room with its lamps and ambient light.

    Attributes:
        faces: `[6]` positions of the faces, as in `SceneArrays.room`.
        paints: Paints of the faces.
        lights: `[L, 15]` lamps, as in `SceneArrays.lights`.
        ambient: `[2, 3]` ambient light, as in `SceneArrays.ambient`.
    """

    faces: Float64
    paints: tuple[Paint, ...]
    lights: Float64
    ambient: Float64


def pack_scene_arrays(groups: Sequence[Sequence[Solid]], room: Room) -> SceneArrays:
    """Pack a room and groups of solids into flat arrays."""
    solids = [solid for group in groups for solid in group]
    rows = np.stack([_pack_solid(solid) for solid in solids])
    stops = np.cumsum([len(group) for group in groups])
    starts = stops - [len(group) for group in groups]
    spheres = [
        _bounding_sphere(rows[start:stop, :4]) for start, stop in zip(starts, stops, strict=True)
    ]
    return SceneArrays(
        solids=rows,
        groups=np.column_stack((np.stack(spheres), starts, stops)),
        paints=np.stack(
            [
                paint.as_row()
                for paint in (*(painted_solid.paint for painted_solid in solids), *room.paints)
            ]
        ),
        room=room.faces,
        lights=room.lights,
        ambient=room.ambient,
    )


def _pack_solid(solid: Solid) -> Float64:
    inverse = np.linalg.inv(solid.matrix)[:3].ravel()
    return np.array([*solid.bounds(), *inverse, solid.shape, solid.parameter, *solid.sizes])


def _bounding_sphere(spheres: Float64) -> Float64:
    """Return the center and radius `[4]` of a sphere that contains the spheres `[N, 4]`."""
    low = (spheres[:, :3] - spheres[:, 3:]).min(axis=0)
    high = (spheres[:, :3] + spheres[:, 3:]).max(axis=0)
    center = (low + high) / 2
    radii = np.linalg.norm(spheres[:, :3] - center, axis=1) + spheres[:, 3]
    return np.array([*center, radii.max()])
