"""Kernels that render a stage with nine rays per pixel, averaged in linear light."""

# mypy: allow-untyped-defs

import math

import numpy as np

from quarc_ref.synth.compiled import entrance, plain
from quarc_ref.synth.light_kernels import POINTS, SAMPLES, light_from, list_occluders
from quarc_ref.synth.solid_kernels import MISS
from quarc_ref.synth.trace_kernels import find_before, hit_wall, list_between

_FAR = 12.0  # meters: more than the width of the room
_PATCH = 0.15  # meters: size of patches that share a list of shadow-casting solids
_EXPOSURE = 1.35


@entrance
def render(stage, camera, picture, depths):
    """Render a picture, and the depth range of each pixel.

    Args:
        stage: Stage from `pack_stage`.
        camera: `[15]` numbers: center, right, down, forward; focal length and principal
            point, pixels.
        picture: `[H, W, 3]` float64 output: linear light from 0 to 1.
        depths: `[H, W, 2]` output: minimum and maximum depth.
    """
    lamps, solids = stage.lights.shape[0], stage.solids.shape[0]
    listed = np.empty(solids, dtype=np.int64)
    lists = np.empty((lamps + 1, solids), dtype=np.int64)
    counts = np.empty(lamps + 1, dtype=np.int64)
    hits, found = np.empty(SAMPLES), np.empty(SAMPLES, dtype=np.int64)
    patch = np.full(3, MISS)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            least, most = _cast_pixel(stage, camera, column, row, listed, hits, found)
            r, g, b = _light_pixel(stage, camera, column, row, patch, lists, counts, hits, found)
            picture[row, column, 0], picture[row, column, 1], picture[row, column, 2] = r, g, b
            depths[row, column, 0], depths[row, column, 1] = least, most


@entrance
def measure(stage, camera, points, depths):
    """Compute the depths `[N]` at points `[N, 2]` (x, y) of a camera's picture."""
    listed = np.empty(stage.solids.shape[0], dtype=np.int64)
    for i in range(depths.size):
        ray, slant = _ray_through(camera, points[i, 0], points[i, 1])
        count = list_between(stage, listed, _ahead(ray, 0.0), 0.0, _ahead(ray, _FAR), 0.0)
        t, _ = _find_nearest(stage, listed, count, ray)
        depths[i] = t * slant


@plain
def _apply_exposure(light):
    """Return the recorded value of light, which is below 1."""
    light *= _EXPOSURE
    return 1 - 1 / (1 + light + 0.5 * light * light)


@plain
def _ray_through(camera, u, v):
    """Return the ray through a point of the picture, and the ratio of depth to distance."""
    a, b = (u - camera[13]) / camera[12], (v - camera[14]) / camera[12]
    slant = 1 / math.sqrt(a * a + b * b + 1)
    ray = (
        camera[0],
        camera[1],
        camera[2],
        slant * (a * camera[3] + b * camera[6] + camera[9]),
        slant * (a * camera[4] + b * camera[7] + camera[10]),
        slant * (a * camera[5] + b * camera[8] + camera[11]),
    )
    return ray, slant


@plain
def _ahead(ray, t):
    return ray[0] + t * ray[3], ray[1] + t * ray[4], ray[2] + t * ray[5]


@plain
def _find_nearest(stage, listed, count, ray):
    wall, face = hit_wall(stage.room, ray)
    return find_before(stage.solids, listed, count, ray, wall, stage.solids.shape[0] + face)


@plain
def _cast_pixel(stage, camera, column, row, listed, hits, found):
    """Compute distances and indices of the hits of a pixel's rays; return the depth range."""
    axis, _ = _ray_through(camera, column + 0.5, row + 0.5)
    width = _FAR * math.sqrt(0.5) / camera[12]
    count = list_between(stage, listed, _ahead(axis, 0.0), 0.0, _ahead(axis, _FAR), width)
    least, most = MISS, 0.0
    for s in range(SAMPLES):
        ray, slant = _ray_through(camera, column + POINTS[s, 0], row + POINTS[s, 1])
        hits[s], found[s] = _find_nearest(stage, listed, count, ray)
        least, most = min(least, hits[s] * slant), max(most, hits[s] * slant)
    return least, most


@plain
def _light_pixel(stage, camera, column, row, patch, lists, counts, hits, found):
    """Return the mean light of a pixel's rays.

    Args:
        stage: Stage from `pack_stage`.
        camera: Camera, as for `render`.
        column: Column of the pixel.
        row: Row of the pixel.
        patch: `[3]` center of the ball of `lists`, which moves when a ray leaves it.
        lists: Lists from `list_occluders`.
        counts: Counts from `list_occluders`.
        hits: `[9]` distances to the hits of the rays.
        found: `[9]` rows of the hits in `Stage.paints`.
    """
    r, g, b = 0.0, 0.0, 0.0
    for s in range(SAMPLES):
        ray, _ = _ray_through(camera, column + POINTS[s, 0], row + POINTS[s, 1])
        x, y, z = _ahead(ray, hits[s])
        if (x - patch[0]) ** 2 + (y - patch[1]) ** 2 + (z - patch[2]) ** 2 > _PATCH * _PATCH:
            patch[0], patch[1], patch[2] = x, y, z
            list_occluders(stage, lists, counts, (x, y, z), _PATCH)
        light = light_from(stage, lists, counts, ray, hits[s], found[s], s)
        r += _apply_exposure(light[0]) / SAMPLES
        g += _apply_exposure(light[1]) / SAMPLES
        b += _apply_exposure(light[2]) / SAMPLES
    return r, g, b
