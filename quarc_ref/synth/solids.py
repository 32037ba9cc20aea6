"""Solids of the synthetic scene: shapes of unit size, mapped to the world.

A solid is a shape with an affine matrix to the world and a paint. Matrices are `[4, 4]`
and act on columns, so `at(...) @ rotate_y(...)` rotates first and then translates.
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
        matrix: `[4, 4]` from the shape's space to the world, meters.
        sizes: Meters per unit along the shape's axes, for the paint.
        paint: Appearance of the surface.
        bend: Half the length of a capsule's axis, or the phase of a blob's waves, turns.
    """

    shape: int
    matrix: Matrix
    sizes: Vector
    paint: Paint
    bend: float = 0.0

    def bounds(self) -> NDArray[np.float64]:
        """Return `[4]` center and radius of a bounding sphere."""
        return np.array([*self.matrix[:3, 3], self._reach(self.matrix[:3, :3])])

    def _reach(self, linear: Matrix) -> float:
        if self.shape == BOX:
            return float(np.linalg.norm(_CORNERS @ linear.T, axis=1).max())
        if self.shape == CYLINDER:
            across = float(np.linalg.norm(linear[:, ::2], 2))
            return math.hypot(across, float(np.linalg.norm(linear[:, 1])))
        swell = {CAPSULE: self.bend, BLOB: 2 * BLOB_SWELL}.get(self.shape, 0.0)
        return float(np.linalg.norm(linear, 2)) * (1 + swell)


def at(x: float, y: float, z: float) -> Matrix:
    """Return a translation by x, y and z."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def scale(x: float, y: float, z: float) -> Matrix:
    """Return a scaling along the axes."""
    return np.diag([x, y, z, 1.0])


def rotate_x(angle: float) -> Matrix:
    """Return the rotation of y towards z by an angle in radians."""
    return _turn(angle, 1, 2)


def rotate_y(angle: float) -> Matrix:
    """Return the rotation of z towards x by an angle in radians."""
    return _turn(angle, 2, 0)


def rotate_z(angle: float) -> Matrix:
    """Return the rotation of x towards y by an angle in radians."""
    return _turn(angle, 0, 1)


def ball(frame: Matrix, radius: float, paint: Paint) -> Solid:
    """Return a ball around the origin of a frame."""
    return ellipsoid(frame, (radius, radius, radius), paint)


def ellipsoid(frame: Matrix, radii: Vector, paint: Paint) -> Solid:
    """Return an ellipsoid around the origin of a frame."""
    return Solid(BALL, frame @ scale(*radii), radii, paint)


def box(frame: Matrix, halves: Vector, paint: Paint) -> Solid:
    """Return a box around the origin of a frame, given half its edge lengths."""
    return Solid(BOX, frame @ scale(*halves), halves, paint)


def cylinder(frame: Matrix, radius: float, half: float, paint: Paint) -> Solid:
    """Return a cylinder around the y axis of a frame, given half its height."""
    sizes = (radius, half, radius)
    return Solid(CYLINDER, frame @ scale(*sizes), sizes, paint)


def blob(frame: Matrix, radii: Vector, phase: float, paint: Paint) -> Solid:
    """Return a ball with waves of a phase in turns."""
    return Solid(BLOB, frame @ scale(*radii), radii, paint, phase)


def capsule(start: Matrix, end: Matrix, radius: float, paint: Paint) -> Solid:
    """Return a capsule between the origins of two frames."""
    axis = end[:3, 3] - start[:3, 3]
    length = float(np.linalg.norm(axis))
    frame = at(*(start[:3, 3] + axis / 2)) @ _stand_along(axis / length)
    sizes = (radius, radius, radius)
    return Solid(CAPSULE, frame @ scale(*sizes), sizes, paint, length / (2 * radius))


def _stand_along(axis: NDArray[np.float64]) -> Matrix:
    """Return a rotation that maps y to a unit vector."""
    aside = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < math.sqrt(0.5) else (1.0, 0.0, 0.0))
    aside = aside / np.linalg.norm(aside)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack((aside, axis, np.cross(aside, axis)), axis=1)
    return matrix


def _turn(angle: float, first: int, second: int) -> Matrix:
    matrix = np.eye(4)
    matrix[first, first] = matrix[second, second] = math.cos(angle)
    matrix[second, first] = math.sin(angle)
    matrix[first, second] = -math.sin(angle)
    return matrix
