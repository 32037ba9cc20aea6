"""Kernels for the light reflected by surfaces.

Every ray of a pixel samples one point of each lamp and one direction of the hemisphere
above the surface; together they cover lamps and hemisphere evenly. The samples are the
same for all pixels, cameras and frames, which replaces each large lamp by nine small
ones. Shadows are soft, have no noise, and are consistent between cameras.
"""

# mypy: allow-untyped-defs

import math

import numpy as np
from numpy.typing import NDArray

from quarc_ref.synth.compiled import inlined
from quarc_ref.synth.solid_kernels import outward
from quarc_ref.synth.texture_kernels import color_of
from quarc_ref.synth.trace_kernels import find_before, hit_wall, is_hidden, list_between, to_shape

_SIDE = 3
SAMPLES = _SIDE * _SIDE
_LIFT = 1e-3  # meters: offset of rays that leave a surface
_NEARBY = 0.55  # meters within which solids block ambient light
_BROADNESS = 10.0  # exponent of the highlight


def _spread() -> NDArray[np.float64]:
    """Return `[9, 2]` points of a square, with one point in each of nine cells."""
    order = np.arange(SAMPLES)
    turned = order % _SIDE * _SIDE + order // _SIDE
    return (np.stack((order, turned), axis=1) + 0.5) / SAMPLES


def _sample_hemisphere() -> NDArray[np.float64]:
    """Return `[9, 3]` directions above the xy plane, with higher density near the normal."""
    r, angle = np.sqrt(POINTS[:, 0]), 2 * np.pi * POINTS[:, 1]
    return np.stack((r * np.cos(angle), r * np.sin(angle), np.sqrt(1 - r * r)), axis=1)


POINTS = _spread()
_DIRECTIONS = _sample_hemisphere()


@inlined
def list_occluders(stage, lists, counts, center, radius):
    """List the solids that can cast shadows on points within a ball.

    Args:
        stage: Stage from `pack_stage`.
        lists: `[L + 1, S]` output: solids for each lamp, then for the ambient light.
        counts: `[L + 1]` output: number of solids in each list.
        center: Center of the ball, three numbers.
        radius: Radius of the ball.
    """
    lights, radius = stage.lights, radius + _LIFT
    for lamp in range(lights.shape[0]):
        x = abs(lights[lamp, 3]) + abs(lights[lamp, 6])
        y = abs(lights[lamp, 4]) + abs(lights[lamp, 7])
        z = abs(lights[lamp, 5]) + abs(lights[lamp, 8])
        end = (lights[lamp, 0], lights[lamp, 1], lights[lamp, 2])
        size = max(radius, math.sqrt(x * x + y * y + z * z))
        counts[lamp] = list_between(stage, lists[lamp], center, radius, end, size)
    last, reach = lights.shape[0], radius + _NEARBY
    counts[last] = list_between(stage, lists[last], center, reach, center, reach)


@inlined
def light_from(stage, lists, counts, ray, t, found, s):
    """Return the light that a surface reflects along a ray, in linear RGB.

    Args:
        stage: Stage from `pack_stage`.
        lists: Lists from `list_occluders`.
        counts: Counts from `list_occluders`.
        ray: Origin and direction of length 1, six numbers.
        t: Distance to the hit surface.
        found: Row of the surface in `Stage.paints`.
        s: Index of the ray within its pixel.
    """
    paints, lights = stage.paints, stage.lights
    x, y, z = ray[0] + t * ray[3], ray[1] + t * ray[4], ray[2] + t * ray[5]
    spot, normal = _spot(stage.solids, found, x, y, z)
    albedo = color_of(paints, found, spot)
    place = (x + _LIFT * normal[0], y + _LIFT * normal[1], z + _LIFT * normal[2])
    r, g, b = _ambient(stage, lists, counts, place, normal, (7 * s + 1) % SAMPLES)
    glow = paints[found, 12]
    r, g, b = albedo[0] * (r + glow), albedo[1] * (g + glow), albedo[2] * (b + glow)
    for lamp in range(lights.shape[0]):
        point = (5 + 6 * lamp) * s % SAMPLES
        matt, shine = _lamp(stage, lists, counts, lamp, place, normal, ray, point)
        shine *= paints[found, 11]
        r += lights[lamp, 9] * (matt * albedo[0] + shine)
        g += lights[lamp, 10] * (matt * albedo[1] + shine)
        b += lights[lamp, 11] * (matt * albedo[2] + shine)
    return r, g, b


@inlined
def _spot(solids, found, x, y, z):
    """Return a surface point in the form of `color_of`, and its world normal."""
    if found >= solids.shape[0]:
        face = found - solids.shape[0]
        inward = 1.0 if face % 2 == 0 else -1.0
        a = inward if face < 2 else 0.0
        b = inward if 2 <= face < 4 else 0.0
        c = inward if face >= 4 else 0.0
        return (x, y, z, x, y, z, a, b, c), (a, b, c)
    u, v, w = to_shape(solids, found, x, y, z, 1.0)
    a, b, c = outward(int(solids[found, 16]), solids[found, 17], u, v, w)
    normal = _unit(
        solids[found, 4] * a + solids[found, 8] * b + solids[found, 12] * c,
        solids[found, 5] * a + solids[found, 9] * b + solids[found, 13] * c,
        solids[found, 6] * a + solids[found, 10] * b + solids[found, 14] * c,
    )
    meters = (u * solids[found, 18], v * solids[found, 19], w * solids[found, 20])
    return (*meters, u, v, w, a, b, c), normal


@inlined
def _unit(x, y, z):
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


@inlined
def _lamp(stage, lists, counts, lamp, place, normal, ray, point):
    """Return the diffuse and specular light from a point of a lamp."""
    lights = stage.lights
    a, b = 2 * POINTS[point, 0] - 1, 2 * POINTS[point, 1] - 1
    x = lights[lamp, 0] + a * lights[lamp, 3] + b * lights[lamp, 6] - place[0]
    y = lights[lamp, 1] + a * lights[lamp, 4] + b * lights[lamp, 7] - place[1]
    z = lights[lamp, 2] + a * lights[lamp, 5] + b * lights[lamp, 8] - place[2]
    distance = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / distance, y / distance, z / distance
    facing = x * normal[0] + y * normal[1] + z * normal[2]
    leaving = -(x * lights[lamp, 12] + y * lights[lamp, 13] + z * lights[lamp, 14])
    if facing <= 0 or leaving <= 0:
        return 0.0, 0.0
    if is_hidden(stage.solids, lists[lamp], counts[lamp], (*place, x, y, z), distance):
        return 0.0, 0.0
    matt = facing * leaving / (distance * distance)
    half = _unit(x - ray[3], y - ray[4], z - ray[5])
    along = half[0] * normal[0] + half[1] * normal[1] + half[2] * normal[2]
    return matt, matt * max(along, 0.0) ** 8


@inlined
def _ambient(stage, lists, counts, place, normal, s):
    """Return the ambient light, reduced near other solids."""
    x, y, z = _above(normal, s)
    ray, last = (*place, x, y, z), stage.lights.shape[0]
    wall, _ = hit_wall(stage.room, ray)
    free, _ = find_before(stage.solids, lists[last], counts[last], ray, min(wall, _NEARBY), last)
    up = 0.5 + 0.5 * normal[1]
    high, low = up * free / _NEARBY, (1 - up) * free / _NEARBY
    return (
        high * stage.ambient[0, 0] + low * stage.ambient[1, 0],
        high * stage.ambient[0, 1] + low * stage.ambient[1, 1],
        high * stage.ambient[0, 2] + low * stage.ambient[1, 2],
    )


@inlined
def _above(normal, s):
    """Return a direction of the hemisphere above a surface."""
    if abs(normal[1]) < 0.9:
        tx, ty, tz = _unit(normal[2], 0.0, -normal[0])
    else:
        tx, ty, tz = _unit(0.0, -normal[2], normal[1])
    bx = normal[1] * tz - normal[2] * ty
    by = normal[2] * tx - normal[0] * tz
    bz = normal[0] * ty - normal[1] * tx
    a, b, c = _DIRECTIONS[s, 0], _DIRECTIONS[s, 1], _DIRECTIONS[s, 2]
    return (
        a * tx + b * bx + c * normal[0],
        a * ty + b * by + c * normal[1],
        a * tz + b * bz + c * normal[2],
    )
