"""Kernels that find the first surface that a ray hits, and test visibility between points.

All rays of a pixel are close together, and so are all rays from a surface patch to a lamp. For such
a bundle of rays, the solids whose bounding spheres it can hit are listed once as candidates. Each
ray is tested only against the candidates. The room is a box around all solids and casts no shadows.
"""

# mypy: allow-untyped-defs

import math

from quarc_ref.synth.compiled import inlined_kernel
from quarc_ref.synth.solid_kernels import MISS, find_entry

_EPSILON = 1e-12


@inlined_kernel
def list_candidates(scene_arrays, candidates, start, start_radius, end, end_radius):
    """List the solids that rays from a start sphere to an end sphere may hit.

    Args:
        scene_arrays: Arrays from `pack_scene_arrays`.
        candidates: `[S]` output: indices of solids.
        start: Center of the start sphere, three numbers.
        start_radius: Radius of the start sphere.
        end: Center of the end sphere, three numbers; may equal `start`.
        end_radius: Radius of the end sphere, at least `start_radius`.

    Returns:
        Number of candidates.
    """
    cone = (*start, start_radius, *end, end_radius)
    candidate_count = 0
    for group in range(scene_arrays.groups.shape[0]):
        if not _intersects_cone(scene_arrays.groups, group, cone):
            continue
        for i in range(int(scene_arrays.groups[group, 4]), int(scene_arrays.groups[group, 5])):
            if _intersects_cone(scene_arrays.solids, i, cone):
                candidates[candidate_count] = i
                candidate_count += 1
    return candidate_count


@inlined_kernel
def find_nearest_hit(solids, candidates, candidate_count, ray, nearest_distance, nearest_index):
    """Return the distance and index of the nearest candidate, or the earlier hit if it is nearer.

    Args:
        solids: Solids of the scene.
        candidates: `[S]` indices of the solids that the ray can hit.
        candidate_count: Number of candidates.
        ray: Origin and unit direction of the ray, six numbers.
        nearest_distance: Distance of the nearest earlier hit.
        nearest_index: Index of the surface of the nearest earlier hit.
    """
    for j in range(candidate_count):
        i = candidates[j]
        if _intersects_sphere(solids, i, ray, nearest_distance):
            distance = _find_solid_entry(solids, i, ray)
            if distance < nearest_distance:
                nearest_distance, nearest_index = distance, i
    return nearest_distance, nearest_index


@inlined_kernel
def is_occluded(solids, candidates, candidate_count, ray, max_distance):
    """Return whether a candidate blocks a ray within a distance limit."""
    for j in range(candidate_count):
        i = candidates[j]
        if (
            _intersects_sphere(solids, i, ray, max_distance)
            and _find_solid_entry(solids, i, ray) < max_distance
        ):
            return True
    return False


@inlined_kernel
def find_wall_hit(room, ray):
    """Return the distance and the index of the wall that a ray from inside the room hits."""
    x_distance, x_face = _find_wall_hit_along(room, 0, ray[0], ray[3])
    y_distance, y_face = _find_wall_hit_along(room, 2, ray[1], ray[4])
    z_distance, z_face = _find_wall_hit_along(room, 4, ray[2], ray[5])
    if x_distance <= y_distance and x_distance <= z_distance:
        return x_distance, x_face
    return (y_distance, y_face) if y_distance <= z_distance else (z_distance, z_face)


@inlined_kernel
def to_shape_space(solids, i, x, y, z, homogeneous):
    """Map a point (`homogeneous` = 1) or a direction (`homogeneous` = 0) to the shape's space."""
    return (
        solids[i, 4] * x + solids[i, 5] * y + solids[i, 6] * z + solids[i, 7] * homogeneous,
        solids[i, 8] * x + solids[i, 9] * y + solids[i, 10] * z + solids[i, 11] * homogeneous,
        solids[i, 12] * x + solids[i, 13] * y + solids[i, 14] * z + solids[i, 15] * homogeneous,
    )


@inlined_kernel
def _find_wall_hit_along(room, first_face, origin, direction):
    if abs(direction) < _EPSILON:
        return MISS, first_face
    face = first_face + 1 if direction > 0 else first_face
    return (room[face] - origin) / direction, face


@inlined_kernel
def _intersects_cone(spheres, i, cone):
    """Return whether a sphere intersects a cone of rays."""
    x, y, z = spheres[i, 0] - cone[0], spheres[i, 1] - cone[1], spheres[i, 2] - cone[2]
    ax, ay, az = cone[4] - cone[0], cone[5] - cone[1], cone[6] - cone[2]
    squared_length = ax * ax + ay * ay + az * az + _EPSILON
    position = min(max((x * ax + y * ay + z * az) / squared_length, 0.0), 1.0)
    x, y, z = x - position * ax, y - position * ay, z - position * az
    widening = cone[7] - cone[3]
    radius_sum = spheres[i, 3] + cone[3] + position * widening
    # The cone widens, so the point of contact is slightly beyond the center of the sphere.
    return (x * x + y * y + z * z) * (
        1 - widening * widening / squared_length
    ) <= radius_sum * radius_sum


@inlined_kernel
def _intersects_sphere(spheres, i, ray, max_distance):
    """Return whether a ray hits a sphere within a distance limit."""
    x, y, z = spheres[i, 0] - ray[0], spheres[i, 1] - ray[1], spheres[i, 2] - ray[2]
    projection = x * ray[3] + y * ray[4] + z * ray[5]
    squared_distance_outside = x * x + y * y + z * z - spheres[i, 3] * spheres[i, 3]
    if squared_distance_outside <= 0:
        return True
    if projection <= 0 or squared_distance_outside > projection * projection:
        return False
    return projection - math.sqrt(projection * projection - squared_distance_outside) < max_distance


@inlined_kernel
def _find_solid_entry(solids, i, ray):
    ox, oy, oz = to_shape_space(solids, i, ray[0], ray[1], ray[2], 1.0)
    dx, dy, dz = to_shape_space(solids, i, ray[3], ray[4], ray[5], 0.0)
    return find_entry(int(solids[i, 16]), solids[i, 17], ox, oy, oz, dx, dy, dz)
