"""Kernels that compute the light that surfaces reflect.

Every ray of a pixel samples one point of each lamp and one direction of the hemisphere
above the surface. The nine rays of a pixel cover the lamps and the hemisphere evenly. All pixels,
cameras and frames use the same samples, so a large lamp acts as nine small lamps. Shadows
are soft, have no noise, and are consistent between cameras.
"""

# mypy: allow-untyped-defs

import math

import numpy as np
from numpy.typing import NDArray

from quarc_ref.synth.compiled import inlined_kernel
from quarc_ref.synth.solid_kernels import compute_normal
from quarc_ref.synth.texture_kernels import evaluate_paint
from quarc_ref.synth.trace_kernels import (
    find_nearest_hit,
    find_wall_hit,
    is_occluded,
    list_candidates,
    to_shape_space,
)

_GRID_SIDE = 3
SAMPLE_COUNT = _GRID_SIDE * _GRID_SIDE
_SURFACE_OFFSET = 1e-3  # meters from a surface to the origin of a ray that leaves it
_AMBIENT_RANGE = 0.55  # meters; solids within this distance block ambient light


def _spread_points() -> NDArray[np.float64]:
    """Return `[9, 2]` points in the unit square, one in each cell of a 3 x 3 grid."""
    indices = np.arange(SAMPLE_COUNT)
    transposed_indices = indices % _GRID_SIDE * _GRID_SIDE + indices // _GRID_SIDE
    return (np.stack((indices, transposed_indices), axis=1) + 0.5) / SAMPLE_COUNT


def _sample_hemisphere() -> NDArray[np.float64]:
    """Return `[9, 3]` directions above the xy plane, which are denser near the z axis."""
    r, angle = np.sqrt(SAMPLE_POINTS[:, 0]), 2 * np.pi * SAMPLE_POINTS[:, 1]
    return np.stack((r * np.cos(angle), r * np.sin(angle), np.sqrt(1 - r * r)), axis=1)


SAMPLE_POINTS = _spread_points()
_SAMPLE_DIRECTIONS = _sample_hemisphere()


@inlined_kernel
def list_occluders(scene_arrays, occluders, occluder_counts, center, radius):
    """List the solids that can cast shadows on points within a sphere.

    Args:
        scene_arrays: Arrays from `pack_scene_arrays`.
        occluders: `[L + 1, S]` output: row i lists the indices of the solids that can block lamp i,
            and the last row lists those that can block the ambient light.
        occluder_counts: `[L + 1]` output: numbers of solids in the rows of `occluders`.
        center: Center of the sphere, three numbers.
        radius: Radius of the sphere.
    """
    lights, radius = scene_arrays.lights, radius + _SURFACE_OFFSET
    for lamp in range(lights.shape[0]):
        x = abs(lights[lamp, 3]) + abs(lights[lamp, 6])
        y = abs(lights[lamp, 4]) + abs(lights[lamp, 7])
        z = abs(lights[lamp, 5]) + abs(lights[lamp, 8])
        end = (lights[lamp, 0], lights[lamp, 1], lights[lamp, 2])
        end_radius = max(radius, math.sqrt(x * x + y * y + z * z))
        occluder_counts[lamp] = list_candidates(
            scene_arrays, occluders[lamp], center, radius, end, end_radius
        )
    ambient_index, ambient_radius = lights.shape[0], radius + _AMBIENT_RANGE
    occluder_counts[ambient_index] = list_candidates(
        scene_arrays, occluders[ambient_index], center, ambient_radius, center, ambient_radius
    )


@inlined_kernel
def reflect_light(scene_arrays, occluders, occluder_counts, ray, hit_distance, surface, sample):
    """Return the light that a surface reflects along a ray, in linear RGB.

    Args:
        scene_arrays: Arrays from `pack_scene_arrays`.
        occluders: Solids from `list_occluders`.
        occluder_counts: Numbers of solids from `list_occluders`.
        ray: Origin and unit direction of the ray, six numbers.
        hit_distance: Distance to the hit surface.
        surface: Row of the surface in `SceneArrays.paints`.
        sample: Index of the ray within its pixel.
    """
    paints, lights = scene_arrays.paints, scene_arrays.lights
    x, y, z = (
        ray[0] + hit_distance * ray[3],
        ray[1] + hit_distance * ray[4],
        ray[2] + hit_distance * ray[5],
    )
    spot, normal = _locate_spot(scene_arrays.solids, surface, x, y, z)
    albedo = evaluate_paint(paints, surface, spot)
    origin = (
        x + _SURFACE_OFFSET * normal[0],
        y + _SURFACE_OFFSET * normal[1],
        z + _SURFACE_OFFSET * normal[2],
    )
    r, g, b = _compute_ambient_light(
        scene_arrays, occluders, occluder_counts, origin, normal, (7 * sample + 1) % SAMPLE_COUNT
    )
    glow = paints[surface, 12]
    r, g, b = albedo[0] * (r + glow), albedo[1] * (g + glow), albedo[2] * (b + glow)
    for lamp in range(lights.shape[0]):
        point_index = (5 + 6 * lamp) * sample % SAMPLE_COUNT
        diffuse, specular = _compute_lamp_light(
            scene_arrays, occluders, occluder_counts, lamp, origin, normal, ray, point_index
        )
        specular *= paints[surface, 11]
        r += lights[lamp, 9] * (diffuse * albedo[0] + specular)
        g += lights[lamp, 10] * (diffuse * albedo[1] + specular)
        b += lights[lamp, 11] * (diffuse * albedo[2] + specular)
    return r, g, b


@inlined_kernel
def _locate_spot(solids, surface, x, y, z):
    """Return the spot (see `texture_kernels`) and the world-space normal of a surface point."""
    if surface >= solids.shape[0]:
        face = surface - solids.shape[0]
        inward = 1.0 if face % 2 == 0 else -1.0
        a = inward if face < 2 else 0.0
        b = inward if 2 <= face < 4 else 0.0
        c = inward if face >= 4 else 0.0
        return (x, y, z, x, y, z, a, b, c), (a, b, c)
    u, v, w = to_shape_space(solids, surface, x, y, z, 1.0)
    a, b, c = compute_normal(int(solids[surface, 16]), solids[surface, 17], u, v, w)
    normal = _normalize(
        solids[surface, 4] * a + solids[surface, 8] * b + solids[surface, 12] * c,
        solids[surface, 5] * a + solids[surface, 9] * b + solids[surface, 13] * c,
        solids[surface, 6] * a + solids[surface, 10] * b + solids[surface, 14] * c,
    )
    meter_coordinates = (u * solids[surface, 18], v * solids[surface, 19], w * solids[surface, 20])
    return (*meter_coordinates, u, v, w, a, b, c), normal


@inlined_kernel
def _normalize(x, y, z):
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


@inlined_kernel
def _compute_lamp_light(
    scene_arrays, occluders, occluder_counts, lamp, origin, normal, ray, point_index
):
    """Return the diffuse and the specular light that comes from a sample point of a lamp."""
    lights = scene_arrays.lights
    a, b = 2 * SAMPLE_POINTS[point_index, 0] - 1, 2 * SAMPLE_POINTS[point_index, 1] - 1
    x = lights[lamp, 0] + a * lights[lamp, 3] + b * lights[lamp, 6] - origin[0]
    y = lights[lamp, 1] + a * lights[lamp, 4] + b * lights[lamp, 7] - origin[1]
    z = lights[lamp, 2] + a * lights[lamp, 5] + b * lights[lamp, 8] - origin[2]
    distance = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / distance, y / distance, z / distance
    incident_cosine = x * normal[0] + y * normal[1] + z * normal[2]
    emission_cosine = -(x * lights[lamp, 12] + y * lights[lamp, 13] + z * lights[lamp, 14])
    if incident_cosine <= 0 or emission_cosine <= 0:
        return 0.0, 0.0
    if is_occluded(
        scene_arrays.solids, occluders[lamp], occluder_counts[lamp], (*origin, x, y, z), distance
    ):
        return 0.0, 0.0
    diffuse = incident_cosine * emission_cosine / (distance * distance)
    half_vector = _normalize(x - ray[3], y - ray[4], z - ray[5])
    half_cosine = (
        half_vector[0] * normal[0] + half_vector[1] * normal[1] + half_vector[2] * normal[2]
    )
    return diffuse, diffuse * max(half_cosine, 0.0) ** 8


@inlined_kernel
def _compute_ambient_light(
    scene_arrays, occluders, occluder_counts, origin, normal, direction_index
):
    """Return the ambient light, which is weaker near other solids."""
    x, y, z = _rotate_sample(normal, direction_index)
    ray, ambient_index = (*origin, x, y, z), scene_arrays.lights.shape[0]
    wall_distance, _ = find_wall_hit(scene_arrays.room, ray)
    unoccluded_distance, _ = find_nearest_hit(
        scene_arrays.solids,
        occluders[ambient_index],
        occluder_counts[ambient_index],
        ray,
        min(wall_distance, _AMBIENT_RANGE),
        ambient_index,
    )
    up_share = 0.5 + 0.5 * normal[1]
    upper_weight, lower_weight = (
        up_share * unoccluded_distance / _AMBIENT_RANGE,
        (1 - up_share) * unoccluded_distance / _AMBIENT_RANGE,
    )
    return (
        upper_weight * scene_arrays.ambient[0, 0] + lower_weight * scene_arrays.ambient[1, 0],
        upper_weight * scene_arrays.ambient[0, 1] + lower_weight * scene_arrays.ambient[1, 1],
        upper_weight * scene_arrays.ambient[0, 2] + lower_weight * scene_arrays.ambient[1, 2],
    )


@inlined_kernel
def _rotate_sample(normal, direction_index):
    """Return a sample direction, rotated to the hemisphere above a surface."""
    if abs(normal[1]) < 0.9:
        tx, ty, tz = _normalize(normal[2], 0.0, -normal[0])
    else:
        tx, ty, tz = _normalize(0.0, -normal[2], normal[1])
    bx = normal[1] * tz - normal[2] * ty
    by = normal[2] * tx - normal[0] * tz
    bz = normal[0] * ty - normal[1] * tx
    a, b, c = (
        _SAMPLE_DIRECTIONS[direction_index, 0],
        _SAMPLE_DIRECTIONS[direction_index, 1],
        _SAMPLE_DIRECTIONS[direction_index, 2],
    )
    return (
        a * tx + b * bx + c * normal[0],
        a * ty + b * by + c * normal[1],
        a * tz + b * bz + c * normal[2],
    )
