"""Kernels that render a scene with nine rays per pixel, which are averaged in linear light."""

# mypy: allow-untyped-defs

import math

import numpy as np

from quarc_ref.synth.compiled import entry_kernel, kernel
from quarc_ref.synth.light_kernels import SAMPLE_COUNT, SAMPLE_POINTS, list_occluders, reflect_light
from quarc_ref.synth.solid_kernels import MISS
from quarc_ref.synth.trace_kernels import find_nearest_hit, find_wall_hit, list_candidates

_MAX_DISTANCE = 12.0  # meters; greater than any distance within the room
_PATCH_RADIUS = 0.15  # meters; surface points within this radius share a list of occluders
_EXPOSURE = 1.35


@entry_kernel
def render_picture(scene_arrays, camera, picture, depths):
    """Render a picture and compute the depth range of each pixel.

    Args:
        scene_arrays: Arrays from `pack_scene_arrays`.
        camera: `[15]` center; directions right, down and forward; focal length in pixels; principal
            point in pixels.
        picture: `[H, W, 3]` float64 output: linear light from 0 to 1.
        depths: `[H, W, 2]` output: minimum and maximum depth.
    """
    lamp_count, solid_count = scene_arrays.lights.shape[0], scene_arrays.solids.shape[0]
    candidates = np.empty(solid_count, dtype=np.int64)
    occluders = np.empty((lamp_count + 1, solid_count), dtype=np.int64)
    occluder_counts = np.empty(lamp_count + 1, dtype=np.int64)
    hit_distances, hit_surfaces = np.empty(SAMPLE_COUNT), np.empty(SAMPLE_COUNT, dtype=np.int64)
    patch_center = np.full(3, MISS)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            min_depth, max_depth = _cast_pixel(
                scene_arrays, camera, column, row, candidates, hit_distances, hit_surfaces
            )
            r, g, b = _light_pixel(
                scene_arrays,
                camera,
                column,
                row,
                patch_center,
                occluders,
                occluder_counts,
                hit_distances,
                hit_surfaces,
            )
            picture[row, column, 0], picture[row, column, 1], picture[row, column, 2] = r, g, b
            depths[row, column, 0], depths[row, column, 1] = min_depth, max_depth


@entry_kernel
def measure_depths(scene_arrays, camera, pixels, depths):
    """Compute the depths `[N]`, in meters, at the pixel positions `[N, 2]` (x, y)."""
    candidates = np.empty(scene_arrays.solids.shape[0], dtype=np.int64)
    for i in range(depths.size):
        ray, depth_ratio = _cast_ray(camera, pixels[i, 0], pixels[i, 1])
        candidate_count = list_candidates(
            scene_arrays,
            candidates,
            _point_on_ray(ray, 0.0),
            0.0,
            _point_on_ray(ray, _MAX_DISTANCE),
            0.0,
        )
        distance, _ = _find_first_surface(scene_arrays, candidates, candidate_count, ray)
        depths[i] = distance * depth_ratio


@kernel
def _apply_exposure(light):
    """Return the value below 1 that a camera records for linear light."""
    light *= _EXPOSURE
    return 1 - 1 / (1 + light + 0.5 * light * light)


@kernel
def _cast_ray(camera, u, v):
    """Return the ray through a point of the picture, and its ratio of depth to distance."""
    a, b = (u - camera[13]) / camera[12], (v - camera[14]) / camera[12]
    depth_ratio = 1 / math.sqrt(a * a + b * b + 1)
    ray = (
        camera[0],
        camera[1],
        camera[2],
        depth_ratio * (a * camera[3] + b * camera[6] + camera[9]),
        depth_ratio * (a * camera[4] + b * camera[7] + camera[10]),
        depth_ratio * (a * camera[5] + b * camera[8] + camera[11]),
    )
    return ray, depth_ratio


@kernel
def _point_on_ray(ray, distance):
    return ray[0] + distance * ray[3], ray[1] + distance * ray[4], ray[2] + distance * ray[5]


@kernel
def _find_first_surface(scene_arrays, candidates, candidate_count, ray):
    wall_distance, face = find_wall_hit(scene_arrays.room, ray)
    return find_nearest_hit(
        scene_arrays.solids,
        candidates,
        candidate_count,
        ray,
        wall_distance,
        scene_arrays.solids.shape[0] + face,
    )


@kernel
def _cast_pixel(scene_arrays, camera, column, row, candidates, hit_distances, hit_surfaces):
    """Store the distances and the surfaces that a pixel's rays hit; return the depth range."""
    center_ray, _ = _cast_ray(camera, column + 0.5, row + 0.5)
    cone_radius = _MAX_DISTANCE * math.sqrt(0.5) / camera[12]
    candidate_count = list_candidates(
        scene_arrays,
        candidates,
        _point_on_ray(center_ray, 0.0),
        0.0,
        _point_on_ray(center_ray, _MAX_DISTANCE),
        cone_radius,
    )
    min_depth, max_depth = MISS, 0.0
    for sample in range(SAMPLE_COUNT):
        ray, depth_ratio = _cast_ray(
            camera, column + SAMPLE_POINTS[sample, 0], row + SAMPLE_POINTS[sample, 1]
        )
        hit_distances[sample], hit_surfaces[sample] = _find_first_surface(
            scene_arrays, candidates, candidate_count, ray
        )
        min_depth, max_depth = (
            min(min_depth, hit_distances[sample] * depth_ratio),
            max(max_depth, hit_distances[sample] * depth_ratio),
        )
    return min_depth, max_depth


@kernel
def _light_pixel(
    scene_arrays,
    camera,
    column,
    row,
    patch_center,
    occluders,
    occluder_counts,
    hit_distances,
    hit_surfaces,
):
    """Return the mean recorded light of a pixel's rays, in linear RGB.

    Args:
        scene_arrays: Arrays from `pack_scene_arrays`.
        camera: `[15]` camera; see `render_picture`.
        column: Column of the pixel.
        row: Row of the pixel.
        patch_center: `[3]` center of the patch for which `occluders` are valid. If a
            ray hits a point outside the patch, the center moves there and the occluders are
            listed again.
        occluders: Solids from `list_occluders`.
        occluder_counts: Numbers of solids from `list_occluders`.
        hit_distances: `[9]` distances to the points that the rays hit.
        hit_surfaces: `[9]` rows, in `SceneArrays.paints`, of the surfaces that the rays hit.
    """
    r, g, b = 0.0, 0.0, 0.0
    for sample in range(SAMPLE_COUNT):
        ray, _ = _cast_ray(
            camera, column + SAMPLE_POINTS[sample, 0], row + SAMPLE_POINTS[sample, 1]
        )
        x, y, z = _point_on_ray(ray, hit_distances[sample])
        if (x - patch_center[0]) ** 2 + (y - patch_center[1]) ** 2 + (
            z - patch_center[2]
        ) ** 2 > _PATCH_RADIUS * _PATCH_RADIUS:
            patch_center[0], patch_center[1], patch_center[2] = x, y, z
            list_occluders(scene_arrays, occluders, occluder_counts, (x, y, z), _PATCH_RADIUS)
        light = reflect_light(
            scene_arrays,
            occluders,
            occluder_counts,
            ray,
            hit_distances[sample],
            hit_surfaces[sample],
            sample,
        )
        r += _apply_exposure(light[0]) / SAMPLE_COUNT
        g += _apply_exposure(light[1]) / SAMPLE_COUNT
        b += _apply_exposure(light[2]) / SAMPLE_COUNT
    return r, g, b
