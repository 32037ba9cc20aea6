"""Kernels for the patterns of the room: wooden floor, rug and track, bricks, wallpaper.

Coordinates are in world space, in meters.
"""

# mypy: allow-untyped-defs

import math

from quarc_ref.synth.compiled import plain
from quarc_ref.synth.noise_kernels import blend, hash_uniform, noise, ramp, shade

RUG = 1.02
TRACK = 1.5
TRACK_HALF = 0.17
_PLANK, _PLANK_LENGTH = 0.21, 1.7
_BRICK, _BRICK_LENGTH = 0.17, 0.42
_PAPER_STRIPE = 0.36
_DADO = 0.78
_SKIRTING = 0.13


@plain
def paint_floor(colors, phase, x, z):
    """Return the color of the floor; `colors` are light wood, dark wood and rug."""
    r = math.hypot(x, z)
    if r < RUG:
        return _rug(colors, phase, x, z, r)
    wood = _planks(colors, phase, x, z)
    off = abs(r - TRACK)
    if off > TRACK_HALF + 0.02:
        return wood
    return blend(_track(colors, x, z, off), wood, ramp(off, TRACK_HALF - 0.01, TRACK_HALF + 0.02))


@plain
def _planks(colors, phase, x, z):
    row = math.floor(z / _PLANK)
    along = x / _PLANK_LENGTH + hash_uniform(int(row), 3, 5)
    board = math.floor(along)
    across = abs(z / _PLANK - row - 0.5)
    end = abs(along - board - 0.5)
    tint = 0.72 + 0.42 * hash_uniform(int(row), int(board), 11)
    grain = noise(1.6 * x + phase, 11 * z, 0.37 * row)
    wood = shade(blend(colors[0], colors[1], 0.25 + 0.75 * grain), tint)
    groove = max(ramp(across, 0.42, 0.5), ramp(end, 0.492, 0.5))
    return shade(wood, 1 - 0.5 * groove)


@plain
def _rug(colors, phase, x, z, r):
    """Return the color of a round rug with a rim, a ring of petals, and a disk."""
    pile = 0.88 + 0.24 * noise(13 * x + phase, 13 * z, 2.0)
    light = (0.86, 0.83, 0.76)
    petals = math.cos(12 * math.atan2(z, x) + phase)
    rug = blend(light, colors[2], ramp(r - 0.09 * petals, 0.60, 0.63))
    rug = blend(shade(colors[2], 0.55), rug, ramp(r, 0.36, 0.39))
    rug = blend(light, rug, ramp(abs(r - 0.2), 0.04, 0.06))
    rug = blend(rug, light, ramp(r, 0.88, 0.90))
    return shade(rug, pile)


@plain
def _track(colors, x, z, off):
    """Return the color of a track with sleepers on a pale band and two rails."""
    turn = 40 * (math.atan2(z, x) / (2 * math.pi) + 1)
    sleeper = ramp(abs(turn - math.floor(turn) - 0.5), 0.2, 0.28)
    ground = blend(shade(colors[1], 0.45), (0.62, 0.60, 0.55), sleeper)
    rail = 1 - ramp(abs(off - 0.095), 0.014, 0.026)
    return blend(ground, (0.20, 0.21, 0.24), rail)


@plain
def paint_bricks(colors, phase, x, y):
    """Return the color of a wall; `colors` are light brick, dark brick, mortar."""
    row = math.floor(y / _BRICK)
    along = x / _BRICK_LENGTH + 0.5 * (int(row) % 2)
    brick = math.floor(along)
    tint = hash_uniform(int(row), int(brick), int(64 * phase))
    stain = noise(4 * x + phase, 4 * y, 1.0)
    body = shade(blend(colors[0], colors[1], tint), 0.82 + 0.3 * stain)
    gap = min(
        (0.5 - abs(y / _BRICK - row - 0.5)) * _BRICK,
        (0.5 - abs(along - brick - 0.5)) * _BRICK_LENGTH,
    )
    wall = blend(colors[2], body, ramp(gap, 0.006, 0.02))
    return _above_skirting(wall, y)


@plain
def paint_wallpaper(colors, phase, x, y):
    """Return the color of a wall; `colors` are two of the wallpaper and one of the paneling."""
    if y < _DADO:
        return _above_skirting(_paneling(colors, x, y), y)
    stripe = (x + phase) / _PAPER_STRIPE
    column = math.floor(stripe)
    aside = stripe - column - 0.5
    up = y / _PAPER_STRIPE + 0.5 * (int(column) % 2)
    figure = math.hypot(aside, up - math.floor(up) - 0.5)
    paper = colors[0] if int(column) % 2 else blend(colors[0], colors[1], 0.6)
    return blend(colors[1], paper, ramp(abs(figure - 0.16), 0.05, 0.10))


@plain
def _paneling(colors, x, y):
    if y > _DADO - 0.05:
        return shade(colors[2], 1.04)
    column = x / 0.5 - math.floor(x / 0.5)
    rim = min(min(column, 1 - column) * 0.5, _DADO - 0.05 - y, y - _SKIRTING)
    return shade(colors[2], 0.86 - 0.28 * (1 - ramp(abs(rim - 0.075), 0.008, 0.025)))


@plain
def _above_skirting(wall, y):
    return blend((0.78, 0.76, 0.72), wall, ramp(y, _SKIRTING - 0.008, _SKIRTING + 0.008))
