"""Kernels that find the first hit of rays, and test visibility between points.

The rays of a pixel are similar, and so are those to a lamp. The solids that a bundle of
rays can hit are listed once by bounding spheres, and each ray is tested only against
them. The room is a box around everything and casts no shadows.
"""

# mypy: allow-untyped-defs

import math

from quarc_ref.synth.compiled import inlined
from quarc_ref.synth.solid_kernels import MISS, entry

_FLAT = 1e-12


@inlined
def list_between(stage, listed, start, start_radius, end, end_radius):
    """List the solids that rays from one ball to another may hit.

    Args:
        stage: Stage from `pack_stage`.
        listed: `[S]` output: indices of solids.
        start: Center of the ball in which rays start, three numbers.
        start_radius: Radius of that ball.
        end: Center of the ball in which they end, which may be the same.
        end_radius: Radius of that ball, at least the other radius.

    Returns:
        Number of listed solids.
    """
    cone = (*start, start_radius, *end, end_radius)
    count = 0
    for g in range(stage.groups.shape[0]):
        if not _reaches_into(stage.groups, g, cone):
            continue
        for i in range(int(stage.groups[g, 4]), int(stage.groups[g, 5])):
            if _reaches_into(stage.solids, i, cone):
                listed[count] = i
                count += 1
    return count


@inlined
def find_before(solids, listed, count, ray, best, found):
    """Return distance and index of the nearest hit: of a solid, or the given hit if it is nearer.

    Args:
        solids: Solids of the stage.
        listed: `[S]` indices of the solids that the ray can hit.
        count: Number of these.
        ray: Origin and direction of length 1, six numbers.
        best: Distance of the nearest hit so far.
        found: Index of the solid of that hit.
    """
    for j in range(count):
        i = listed[j]
        if _meets(solids, i, ray, best):
            t = _enter(solids, i, ray)
            if t < best:
                best, found = t, i
    return best, found


@inlined
def is_hidden(solids, listed, count, ray, limit):
    """Return whether a listed solid blocks a ray before a limit."""
    for j in range(count):
        i = listed[j]
        if _meets(solids, i, ray, limit) and _enter(solids, i, ray) < limit:
            return True
    return False


@inlined
def hit_wall(room, ray):
    """Return distance and index of the wall that a ray from inside hits."""
    x, x_face = _hit_wall_along(room, 0, ray[0], ray[3])
    y, y_face = _hit_wall_along(room, 2, ray[1], ray[4])
    z, z_face = _hit_wall_along(room, 4, ray[2], ray[5])
    if x <= y and x <= z:
        return x, x_face
    return (y, y_face) if y <= z else (z, z_face)


@inlined
def to_shape(solids, i, x, y, z, share):
    """Return a point (share 1) or a direction (share 0) in a solid's space."""
    return (
        solids[i, 4] * x + solids[i, 5] * y + solids[i, 6] * z + solids[i, 7] * share,
        solids[i, 8] * x + solids[i, 9] * y + solids[i, 10] * z + solids[i, 11] * share,
        solids[i, 12] * x + solids[i, 13] * y + solids[i, 14] * z + solids[i, 15] * share,
    )


@inlined
def _hit_wall_along(room, first, o, d):
    if abs(d) < _FLAT:
        return MISS, first
    face = first + 1 if d > 0 else first
    return (room[face] - o) / d, face


@inlined
def _reaches_into(spheres, i, cone):
    """Return whether a sphere intersects a cone of rays."""
    x, y, z = spheres[i, 0] - cone[0], spheres[i, 1] - cone[1], spheres[i, 2] - cone[2]
    ax, ay, az = cone[4] - cone[0], cone[5] - cone[1], cone[6] - cone[2]
    length2 = ax * ax + ay * ay + az * az + _FLAT
    share = min(max((x * ax + y * ay + z * az) / length2, 0.0), 1.0)
    x, y, z = x - share * ax, y - share * ay, z - share * az
    wider = cone[7] - cone[3]
    reach = spheres[i, 3] + cone[3] + share * wider
    # The cone widens, so it touches a sphere slightly beyond the sphere's center.
    return (x * x + y * y + z * z) * (1 - wider * wider / length2) <= reach * reach


@inlined
def _meets(spheres, i, ray, limit):
    """Return whether a ray hits a sphere before a limit."""
    x, y, z = spheres[i, 0] - ray[0], spheres[i, 1] - ray[1], spheres[i, 2] - ray[2]
    along = x * ray[3] + y * ray[4] + z * ray[5]
    gap = x * x + y * y + z * z - spheres[i, 3] * spheres[i, 3]
    if gap <= 0:
        return True
    if along <= 0 or gap > along * along:
        return False
    return along - math.sqrt(along * along - gap) < limit


@inlined
def _enter(solids, i, ray):
    ox, oy, oz = to_shape(solids, i, ray[0], ray[1], ray[2], 1.0)
    dx, dy, dz = to_shape(solids, i, ray[3], ray[4], ray[5], 0.0)
    return entry(int(solids[i, 16]), solids[i, 17], ox, oy, oz, dx, dy, dz)
