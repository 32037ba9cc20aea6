"""Solids of the synthetic scene: painted shapes of unit size that are mapped to the world.

A pose is the matrix of an object's coordinate system in the world. Matrices are `[4, 4]` and
act on column vectors, so `translate(...) @ rotate_y(...)` rotates first and then translates.
"""

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from quarc_ref.synth.paints import Paint
from quarc_ref.synth.solid_kernels import BALL, BLOB, BLOB_SWELL, BOX, CAPSULE, CYLINDER

Matrix = NDArray[np.float64]
Vector = tuple[float, float, float]

_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A painted solid in the world.

    Attributes:
        shape: One of the shapes of `solid_kernels`.
        matrix: `[4, 4]` matrix from the shape's space to the world, in meters.
        sizes: Meters per unit of the shape along each of its axes; the paint needs these sizes.
        paint: Appearance of the surface.
        parameter: For a capsule, half the length of its axis in units of its radius; for a blob,
            the phase of its waves in turns; unused for other shapes.
    """

    shape: int
    matrix: Matrix
    sizes: Vector
    paint: Paint
    parameter: float = 0.0

    def bounds(self) -> NDArray[np.float64]:
        """Return the center and the radius of a bounding sphere, `[4]`."""
        return np.array([*self.matrix[:3, 3], self._bounding_radius(self.matrix[:3, :3])])

    def _bounding_radius(self, linear_map: Matrix) -> float:
        if self.shape == BOX:
            return float(np.linalg.norm(_CORNERS @ linear_map.T, axis=1).max())
        if self.shape == CYLINDER:
            cross_radius = float(np.linalg.norm(linear_map[:, ::2], 2))
            return math.hypot(cross_radius, float(np.linalg.norm(linear_map[:, 1])))
        swell = {CAPSULE: self.parameter, BLOB: 2 * BLOB_SWELL}.get(self.shape, 0.0)
        return float(np.linalg.norm(linear_map, 2)) * (1 + swell)


def translate(x: float, y: float, z: float) -> Matrix:
    """Return a translation by x, y and z."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def scale(x: float, y: float, z: float) -> Matrix:
    """Return a scaling along the axes."""
    return np.diag([x, y, z, 1.0])


def rotate_x(angle: float) -> Matrix:
    """Return the rotation from y toward z by an angle in radians."""
    return _rotate(angle, 1, 2)


def rotate_y(angle: float) -> Matrix:
    """Return the rotation from z toward x by an angle in radians."""
    return _rotate(angle, 2, 0)


def rotate_z(angle: float) -> Matrix:
    """Return the rotation from x toward y by an angle in radians."""
    return _rotate(angle, 0, 1)


def ball(pose: Matrix, radius: float, paint: Paint) -> Solid:
    """Return a ball that is centered at a pose."""
    return ellipsoid(pose, (radius, radius, radius), paint)


def ellipsoid(pose: Matrix, radii: Vector, paint: Paint) -> Solid:
    """Return an ellipsoid that is centered at a pose."""
    return Solid(BALL, pose @ scale(*radii), radii, paint)


def box(pose: Matrix, half_sizes: Vector, paint: Paint) -> Solid:
    """Return a box that is centered at a pose, given half its edge lengths."""
    return Solid(BOX, pose @ scale(*half_sizes), half_sizes, paint)


def cylinder(pose: Matrix, radius: float, half_height: float, paint: Paint) -> Solid:
    """Return a cylinder around the y axis of a pose, given half its height."""
    sizes = (radius, half_height, radius)
    return Solid(CYLINDER, pose @ scale(*sizes), sizes, paint)


def blob(pose: Matrix, radii: Vector, phase: float, paint: Paint) -> Solid:
    """Return an ellipsoid with a wavy surface, centered at a pose; the phase is in turns."""
    return Solid(BLOB, pose @ scale(*radii), radii, paint, phase)


def capsule(start: Matrix, end: Matrix, radius: float, paint: Paint) -> Solid:
    """Return a capsule whose axis connects the positions of two poses."""
    axis = end[:3, 3] - start[:3, 3]
    length = float(np.linalg.norm(axis))
    pose = translate(*(start[:3, 3] + axis / 2)) @ _rotate_y_to(axis / length)
    sizes = (radius, radius, radius)
    return Solid(CAPSULE, pose @ scale(*sizes), sizes, paint, length / (2 * radius))


def _rotate_y_to(axis: NDArray[np.float64]) -> Matrix:
    """Return a rotation that maps the y axis to a unit vector."""
    side = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < math.sqrt(0.5) else (1.0, 0.0, 0.0))
    side = side / np.linalg.norm(side)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack((side, axis, np.cross(side, axis)), axis=1)
    return matrix


def _rotate(angle: float, first_axis: int, second_axis: int) -> Matrix:
    matrix = np.eye(4)
    matrix[first_axis, first_axis] = matrix[second_axis, second_axis] = math.cos(angle)
    matrix[second_axis, first_axis] = math.sin(angle)
    matrix[first_axis, second_axis] = -math.sin(angle)
    return matrix
