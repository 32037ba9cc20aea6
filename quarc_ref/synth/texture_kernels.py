"""Kernels that return the linear RGB colors of the patterns on surfaces.

A spot describes a surface point in the space of the shape by nine numbers: the coordinates in
meters, the coordinates in units of the shape, and the normal. Patterns have soft edges and no
detail finer than about 2 cm, the size of a pixel at 160x120.
"""

# mypy: allow-untyped-defs

import math

from quarc_ref.synth.compiled import kernel
from quarc_ref.synth.noise_kernels import blend, hash_uniform, noise, ramp, shade
from quarc_ref.synth.picture_kernels import paint_face, paint_landscape, paint_screen
from quarc_ref.synth.room_kernels import paint_bricks, paint_floor, paint_wallpaper

PLAIN = 0
WOOD = 1
STRIPES = 2
CHECKS = 3
BEACH_BALL = 4
CRATE = 5
BLOCK = 6
DOTS = 7
CHEST = 8
FACE = 9
LANDSCAPE = 10
SCREEN = 11
WINDOW = 12
RINGS = 13
FLOOR = 14
BRICKS = 15
WALLPAPER = 16

_HALF_EDGE_WIDTH = 0.008  # meters


@kernel
def evaluate_paint(paints, paint_index, spot):
    """Return the linear RGB color of a paint at a spot.

    Args:
        paints: `[P, 14]` rows from `Paint.as_row`.
        paint_index: Index of the paint.
        spot: Spot on the surface, nine numbers.
    """
    pattern = int(paints[paint_index, 13])
    paint = (
        (paints[paint_index, 0], paints[paint_index, 1], paints[paint_index, 2]),
        (paints[paint_index, 3], paints[paint_index, 4], paints[paint_index, 5]),
        (paints[paint_index, 6], paints[paint_index, 7], paints[paint_index, 8]),
        paints[paint_index, 9],
        paints[paint_index, 10],
    )
    if pattern >= FLOOR:
        return _evaluate_room_paint(pattern, paint, spot)
    if pattern >= CHEST:
        return _evaluate_picture_paint(pattern, paint, spot)
    if pattern == WOOD:
        return _paint_wood(paint, spot)
    if pattern == STRIPES:
        return _paint_stripes(paint, spot)
    if pattern == CHECKS:
        return _paint_checks(paint, spot)
    if pattern == BEACH_BALL:
        return _paint_beach_ball(paint, spot)
    if pattern == CRATE:
        return _paint_crate(paint, spot)
    if pattern == BLOCK:
        return _paint_block(paint, spot)
    if pattern == DOTS:
        return _paint_dots(paint, spot)
    return _paint_plain(paint, spot)


@kernel
def _evaluate_room_paint(pattern, paint, spot):
    colors = paint[0], paint[1], paint[2]
    if pattern == FLOOR:
        return paint_floor(colors, paint[4], spot[0], spot[2])
    horizontal = spot[2] if abs(spot[6]) > abs(spot[8]) else spot[0]
    if pattern == BRICKS:
        return paint_bricks(colors, paint[4], horizontal, spot[1])
    return paint_wallpaper(colors, paint[4], horizontal, spot[1])


@kernel
def _evaluate_picture_paint(pattern, paint, spot):
    colors = paint[0], paint[1], paint[2]
    if pattern == RINGS:
        return _paint_rings(paint, spot)
    if pattern == CHEST:
        return _paint_chest(paint, spot)
    if pattern == FACE:
        return paint_face(colors, spot[3], spot[4], spot[5])
    if pattern == LANDSCAPE:
        return paint_landscape(colors, paint[4], spot[3], spot[4])
    if pattern == SCREEN:
        return paint_screen(colors, paint[4], spot[3], spot[4])
    return _paint_window(paint, spot)


@kernel
def _project_to_face(spot):
    """Return two coordinates on the face of a box, first in meters, then in units of the shape."""
    if abs(spot[6]) > abs(spot[7]) and abs(spot[6]) > abs(spot[8]):
        return spot[2], spot[1], spot[5], spot[4]
    if abs(spot[7]) > abs(spot[8]):
        return spot[0], spot[2], spot[3], spot[5]
    return spot[0], spot[1], spot[3], spot[4]


@kernel
def _paint_plain(paint, spot):
    cell_size = paint[3]
    cloud = noise(spot[0] / cell_size, spot[1] / cell_size + paint[4], spot[2] / cell_size)
    return shade(paint[0], 0.86 + 0.28 * cloud)


@kernel
def _paint_wood(paint, spot):
    """Return the color of wood with grain along x."""
    first, second, _, _, _ = paint
    x, y, z = spot[0] / paint[3], spot[1] / paint[3], spot[2] / paint[3]
    grain = noise(1.3 * x + paint[4], 9 * y, 9 * z)
    coarse_grain = noise(0.8 * x + paint[4], 3 * y, 3 * z + 7)
    return blend(first, second, ramp(0.6 * grain + 0.4 * coarse_grain, 0.2, 0.8))


@kernel
def _compute_band_coverage(x, share):
    """Return 1 in stripes of width `share` and period 1, and 0 between them, with soft edges."""
    x = abs(x - math.floor(x) - 0.5)
    return 1 - ramp(x, share / 2 - 0.04, share / 2 + 0.04)


@kernel
def _paint_stripes(paint, spot):
    first, second, _, _, _ = paint
    return blend(first, second, _compute_band_coverage(spot[1] / paint[3] + paint[4], 0.5))


@kernel
def _paint_checks(paint, spot):
    first, second, _, _, _ = paint
    u, v, _, _ = _project_to_face(spot)
    i, j = math.floor(u / paint[3] + paint[4]), math.floor(v / paint[3] + paint[4])
    return first if (int(i) + int(j)) % 2 else second


@kernel
def _paint_beach_ball(paint, spot):
    """Return the color of a beach ball: six segments, three of them colored, and two caps."""
    first, second, third, _, _ = paint
    if abs(spot[4]) > 0.94:
        return first
    angle_in_turns = (math.atan2(spot[5], spot[3]) / (2 * math.pi) + paint[4]) % 1.0
    segment = int(6 * angle_in_turns) % 6
    if segment % 2:
        return 0.9, 0.9, 0.88
    return first if segment == 0 else (second if segment == 2 else third)


@kernel
def _paint_crate(paint, spot):
    """Return the color of a crate: a frame and a brace over boards of darker wood."""
    first, second, third, _, _ = paint
    _, _, u, v = _project_to_face(spot)
    grain = noise(2.5 * u + paint[4], 9 * v, spot[6] + 2 * spot[7])
    rim_position = max(abs(u), abs(v))
    brace_distance = abs(u - v)
    if rim_position > 0.76 or brace_distance < 0.2:
        edge_distance = (
            min(abs(rim_position - 0.76), abs(brace_distance - 0.2))
            if rim_position < 0.76
            else abs(rim_position - 0.76)
        )
        return shade(first, (0.8 + 0.35 * grain) * (0.75 + 0.25 * ramp(edge_distance, 0.0, 0.05)))
    board = 1.6 * (v + 1)
    groove_position = abs(board - math.floor(board) - 0.5)
    tint = 0.75 + 0.3 * grain
    return blend(shade(second, tint), third, ramp(groove_position, 0.42, 0.5))


@kernel
def _paint_block(paint, spot):
    """Return the color of a toy block with a rim and a disk, cross or ring on each face."""
    first, second, third, _, _ = paint
    _, _, u, v = _project_to_face(spot)
    if max(abs(u), abs(v)) > 0.8:
        return first
    r = math.hypot(u, v)
    if abs(spot[6]) > abs(spot[7]) and abs(spot[6]) > abs(spot[8]):
        coverage = 1 - ramp(r, 0.46, 0.54)
    elif abs(spot[7]) > abs(spot[8]):
        coverage = 1 - ramp(min(abs(u), abs(v)), 0.15, 0.22)
    else:
        coverage = 1 - ramp(abs(r - 0.4), 0.13, 0.2)
    return blend(second, third, coverage)


@kernel
def _paint_dots(paint, spot):
    first, second, _, _, _ = paint
    x, y, z = spot[0] / paint[3] + paint[4], spot[1] / paint[3], spot[2] / paint[3]
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    r = math.sqrt((x - i - 0.5) ** 2 + (y - j - 0.5) ** 2 + (z - k - 0.5) ** 2)
    tint = 0.85 + 0.3 * hash_uniform(int(i), int(j), int(k))
    return blend(shade(second, tint), first, ramp(r, 0.36, 0.44))


@kernel
def _paint_rings(paint, spot):
    """Return the color of a disk and two rings around the y axis."""
    first, second, third, _, _ = paint
    r = math.hypot(spot[3], spot[5])
    if r < 0.33:
        return third
    return second if r < 0.7 else first


@kernel
def _paint_chest(paint, spot):
    """Return the color of the robot's body, with a round and a square button on a front panel."""
    first, second, third, _, _ = paint
    x, y = spot[3], spot[4]
    if spot[5] < 0 or max(abs(x), abs(y - 0.1)) > 0.5:
        return blend(first, second, _compute_band_coverage(1.6 * y + 0.55, 0.16))
    if math.hypot(x, y - 0.25) < 0.17 or max(abs(x), abs(y + 0.12)) < 0.13:
        return third
    return second


@kernel
def _paint_window(paint, spot):
    """Return the color of a window with a cloudy sky behind crossed bars."""
    first, second, third, _, _ = paint
    u, v, x, y = _project_to_face(spot)
    bar_distance = min(abs(u), abs(v))
    rim_position = max(abs(x), abs(y))
    clouds = ramp(noise(3 * u + paint[4], 6 * v, 0.0), 0.45, 0.75)
    sky = blend(blend(first, second, 0.5 - 0.5 * y), second, clouds)
    frame = max(
        1 - ramp(bar_distance, 0.03 - _HALF_EDGE_WIDTH, 0.03 + _HALF_EDGE_WIDTH),
        ramp(rim_position, 0.90, 0.93),
    )
    return blend(sky, third, frame)
