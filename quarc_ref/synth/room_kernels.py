"""Kernels for the patterns of the room: wooden floor with rug and track, bricks, wallpaper.

Coordinates are world coordinates in meters.
"""

# mypy: allow-untyped-defs

import math

from quarc_ref.synth.compiled import kernel
from quarc_ref.synth.noise_kernels import blend, hash_uniform, noise, ramp, shade

RUG_RADIUS = 1.02
TRACK_RADIUS = 1.5
TRACK_HALF_WIDTH = 0.17
_PLANK_WIDTH, _PLANK_LENGTH = 0.21, 1.7
_BRICK_HEIGHT, _BRICK_LENGTH = 0.17, 0.42
_STRIPE_WIDTH = 0.36
_PANELING_HEIGHT = 0.78
_SKIRTING_HEIGHT = 0.13


@kernel
def paint_floor(colors, phase, x, z):
    """Return the color of the floor; `colors` are those of light wood, dark wood and the rug."""
    r = math.hypot(x, z)
    if r < RUG_RADIUS:
        return _paint_rug(colors, phase, x, z, r)
    wood = _paint_planks(colors, phase, x, z)
    track_distance = abs(r - TRACK_RADIUS)
    if track_distance > TRACK_HALF_WIDTH + 0.02:
        return wood
    return blend(
        _paint_track(colors, x, z, track_distance),
        wood,
        ramp(track_distance, TRACK_HALF_WIDTH - 0.01, TRACK_HALF_WIDTH + 0.02),
    )


@kernel
def _paint_planks(colors, phase, x, z):
    row = math.floor(z / _PLANK_WIDTH)
    board_position = x / _PLANK_LENGTH + hash_uniform(int(row), 3, 5)
    board = math.floor(board_position)
    groove_distance = abs(z / _PLANK_WIDTH - row - 0.5)
    end_distance = abs(board_position - board - 0.5)
    tint = 0.72 + 0.42 * hash_uniform(int(row), int(board), 11)
    grain = noise(1.6 * x + phase, 11 * z, 0.37 * row)
    wood = shade(blend(colors[0], colors[1], 0.25 + 0.75 * grain), tint)
    groove = max(ramp(groove_distance, 0.42, 0.5), ramp(end_distance, 0.492, 0.5))
    return shade(wood, 1 - 0.5 * groove)


@kernel
def _paint_rug(colors, phase, x, z, r):
    """Return the color of a round rug with a rim, a ring of petals, and a disk."""
    pile = 0.88 + 0.24 * noise(13 * x + phase, 13 * z, 2.0)
    light = (0.86, 0.83, 0.76)
    petals = math.cos(12 * math.atan2(z, x) + phase)
    rug = blend(light, colors[2], ramp(r - 0.09 * petals, 0.60, 0.63))
    rug = blend(shade(colors[2], 0.55), rug, ramp(r, 0.36, 0.39))
    rug = blend(light, rug, ramp(abs(r - 0.2), 0.04, 0.06))
    rug = blend(rug, light, ramp(r, 0.88, 0.90))
    return shade(rug, pile)


@kernel
def _paint_track(colors, x, z, track_distance):
    """Return the color of a railroad track: two rails, and ties on a pale band."""
    tie_position = 40 * (math.atan2(z, x) / (2 * math.pi) + 1)
    tie = ramp(abs(tie_position - math.floor(tie_position) - 0.5), 0.2, 0.28)
    ground = blend(shade(colors[1], 0.45), (0.62, 0.60, 0.55), tie)
    rail = 1 - ramp(abs(track_distance - 0.095), 0.014, 0.026)
    return blend(ground, (0.20, 0.21, 0.24), rail)


@kernel
def paint_bricks(colors, phase, x, y):
    """Return the color of a brick wall; `colors` are light brick, dark brick and mortar."""
    row = math.floor(y / _BRICK_HEIGHT)
    brick_position = x / _BRICK_LENGTH + 0.5 * (int(row) % 2)
    brick = math.floor(brick_position)
    tint = hash_uniform(int(row), int(brick), int(64 * phase))
    stain = noise(4 * x + phase, 4 * y, 1.0)
    body = shade(blend(colors[0], colors[1], tint), 0.82 + 0.3 * stain)
    gap = min(
        (0.5 - abs(y / _BRICK_HEIGHT - row - 0.5)) * _BRICK_HEIGHT,
        (0.5 - abs(brick_position - brick - 0.5)) * _BRICK_LENGTH,
    )
    wall = blend(colors[2], body, ramp(gap, 0.006, 0.02))
    return _add_skirting(wall, y)


@kernel
def paint_wallpaper(colors, phase, x, y):
    """Return the color of a wall; `colors` are two wallpaper colors and a paneling color."""
    if y < _PANELING_HEIGHT:
        return _add_skirting(_paint_paneling(colors, x, y), y)
    stripe_position = (x + phase) / _STRIPE_WIDTH
    column = math.floor(stripe_position)
    stripe_offset = stripe_position - column - 0.5
    figure_position = y / _STRIPE_WIDTH + 0.5 * (int(column) % 2)
    figure_distance = math.hypot(stripe_offset, figure_position - math.floor(figure_position) - 0.5)
    paper = colors[0] if int(column) % 2 else blend(colors[0], colors[1], 0.6)
    return blend(colors[1], paper, ramp(abs(figure_distance - 0.16), 0.05, 0.10))


@kernel
def _paint_paneling(colors, x, y):
    if y > _PANELING_HEIGHT - 0.05:
        return shade(colors[2], 1.04)
    panel_position = x / 0.5 - math.floor(x / 0.5)
    rim_distance = min(
        min(panel_position, 1 - panel_position) * 0.5,
        _PANELING_HEIGHT - 0.05 - y,
        y - _SKIRTING_HEIGHT,
    )
    return shade(colors[2], 0.86 - 0.28 * (1 - ramp(abs(rim_distance - 0.075), 0.008, 0.025)))


@kernel
def _add_skirting(wall, y):
    return blend(
        (0.78, 0.76, 0.72), wall, ramp(y, _SKIRTING_HEIGHT - 0.008, _SKIRTING_HEIGHT + 0.008)
    )
