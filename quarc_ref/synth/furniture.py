"""The room and its furniture, which are static except for a door and a screen.

The door slides open once per period and reveals new content. The screen changes to another
picture at about the same time.
"""

import math

import numpy as np

from quarc_ref.synth import texture_kernels as patterns
from quarc_ref.synth.paints import Paint, Palette, mix
from quarc_ref.synth.scene_arrays import Room
from quarc_ref.synth.solids import (
    Matrix,
    Solid,
    ball,
    box,
    cylinder,
    ellipsoid,
    rotate_x,
    rotate_y,
    rotate_z,
    translate,
)

_PERIOD_SECONDS = 3.0
_OPENING_SECONDS = (0.05, 0.50)  # start and end of the opening, from the start of a period
_CLOSING_SECONDS = (2.2, 2.7)
_LEFT, _RIGHT, _BACK, _FRONT, _CEILING = -3.7, 3.7, -2.7, 3.9, 3.2
_LAMP_LIGHT = (9.6, 8.7, 7.4)
_WINDOW_LIGHT = (2.8, 3.4, 4.1)


def compute_opening(time: float, delay: float) -> float:
    """Return how far the door is open, from 0 to 1, at a time in seconds."""
    time_in_period = (time - delay) % _PERIOD_SECONDS
    return _smoothstep(time_in_period, *_OPENING_SECONDS) - _smoothstep(
        time_in_period, *_CLOSING_SECONDS
    )


def _smoothstep(time: float, start: float, end: float) -> float:
    x = min(max((time - start) / (end - start), 0.0), 1.0)
    return x * x * (3 - 2 * x)


def make_room(phase: float, palette: Palette) -> Room:
    """Return the room, which is lit by a ceiling lamp and a window."""
    floor_paint = Paint(patterns.FLOOR, *palette.wood, palette.toy_colors[3], phase=phase)
    brick_paint = Paint(patterns.BRICKS, *palette.brick, phase=phase)
    wallpaper_paint = Paint(patterns.WALLPAPER, *palette.wall, phase=phase)
    ceiling_paint = Paint(patterns.PLAIN, palette.light, palette.light, palette.light)
    lamp = [-0.9, 3.15, 1.3, 0.45, 0.0, 0.0, 0.0, 0.0, 0.45, *_LAMP_LIGHT, 0.0, -1.0, 0.0]
    window = [3.6, 1.75, -0.5, 0.0, 0.0, 0.8, 0.0, 0.5, 0.0, *_WINDOW_LIGHT, -1.0, 0.0, 0.0]
    return Room(
        faces=np.array([_LEFT, _RIGHT, 0.0, _CEILING, _BACK, _FRONT]),
        paints=(
            brick_paint,
            wallpaper_paint,
            floor_paint,
            ceiling_paint,
            wallpaper_paint,
            wallpaper_paint,
        ),
        lights=np.array([lamp, window]),
        ambient=np.array([[0.31, 0.32, 0.34], [0.22, 0.19, 0.16]]),
    )


def make_cabinet(opening: float, phase: float, palette: Palette) -> list[Solid]:
    """Return a cabinet with toys behind a sliding door."""
    pose = translate(-1.75, 0.0, -1.72) @ rotate_y(0.62)
    wood_paint = Paint(patterns.WOOD, *palette.wood, palette.dark, 0.6, phase, 0.08)
    door_paint = Paint(
        patterns.BLOCK, palette.wall[2], palette.wall[1], palette.wood[1], gloss=0.08
    )
    back_paint = Paint(
        patterns.CHECKS,
        palette.toy_colors[2],
        palette.toy_colors[0],
        palette.light,
        0.14,
        glow=0.35,
    )
    parts = [
        box(pose @ translate(0.0, 0.6, -0.22), (0.56, 0.56, 0.02), back_paint),
        box(pose @ translate(-0.56, 0.6, 0.0), (0.02, 0.6, 0.24), wood_paint),
        box(pose @ translate(0.56, 0.6, 0.0), (0.02, 0.6, 0.24), wood_paint),
        box(pose @ translate(0.0, 1.18, 0.0), (0.60, 0.025, 0.27), wood_paint),
        box(pose @ translate(0.0, 0.05, 0.0), (0.56, 0.05, 0.24), wood_paint),
        box(pose @ translate(0.0, 0.62, -0.02), (0.54, 0.02, 0.19), wood_paint),
        box(pose @ translate(-0.27, 0.63, 0.21), (0.27, 0.53, 0.015), door_paint),
        box(pose @ translate(0.27 - 0.54 * opening, 0.63, 0.245), (0.27, 0.53, 0.015), door_paint),
    ]
    return [*parts, *_make_hidden_toys(pose, phase, palette)]


def _make_hidden_toys(pose: Matrix, phase: float, palette: Palette) -> list[Solid]:
    toy_colors = palette.toy_colors
    dotted_paint = Paint(
        patterns.DOTS, toy_colors[4], palette.light, toy_colors[4], 0.15, phase, 0.25, 0.3
    )
    striped_paint = Paint(
        patterns.STRIPES, toy_colors[3], palette.light, toy_colors[3], 0.14, 0.0, 0.25, 0.3
    )
    return [
        ball(pose @ translate(0.3, 0.28, 0.0), 0.17, dotted_paint),
        cylinder(pose @ translate(0.28, 0.81, 0.0), 0.13, 0.17, striped_paint),
        ball(pose @ translate(0.28, 1.05, 0.0), 0.08, dotted_paint),
    ]


def make_screen(wipe: float, palette: Palette) -> list[Solid]:
    """Return a screen on the wall; its second picture covers the share `wipe` of the screen."""
    toy_colors = palette.toy_colors
    paint = Paint(
        patterns.SCREEN, toy_colors[5], palette.light, toy_colors[2], phase=wipe, glow=0.45
    )
    return [box(translate(1.35, 1.42, _BACK + 0.04), (0.56, 0.36, 0.04), paint)]


def make_wall_objects(phase: float, palette: Palette) -> list[list[Solid]]:
    """Return pictures, a window and a shelf with books."""
    toy_colors = palette.toy_colors
    frame_paint = Paint(patterns.WOOD, *palette.wood, palette.dark, 0.4, phase, 0.1)
    hills_paint = Paint(
        patterns.LANDSCAPE, toy_colors[3], toy_colors[1], toy_colors[4], phase=6 * phase
    )
    lake_paint = Paint(
        patterns.LANDSCAPE, toy_colors[4], toy_colors[5], toy_colors[1], phase=6 * phase + 2
    )
    blue, white = (0.25, 0.45, 0.8), (0.85, 0.9, 0.95)
    sky_paint = Paint(patterns.WINDOW, blue, white, palette.light, phase=phase, glow=0.6)
    back_pose = translate(-0.05, 1.5, _BACK + 0.03)
    left_pose = translate(_LEFT + 0.03, 1.45, -0.75) @ rotate_y(math.pi / 2)
    return [
        [
            box(back_pose, (0.46, 0.35, 0.03), frame_paint),
            box(back_pose, (0.39, 0.28, 0.04), hills_paint),
        ],
        [
            box(left_pose, (0.52, 0.40, 0.03), frame_paint),
            box(left_pose, (0.45, 0.33, 0.04), lake_paint),
        ],
        [box(translate(_RIGHT - 0.02, 1.75, -0.5), (0.02, 0.6, 0.9), sky_paint)],
        _make_books(translate(_RIGHT - 0.14, 1.05, -2.1) @ rotate_y(-math.pi / 2), palette),
    ]


def _make_books(pose: Matrix, palette: Palette) -> list[Solid]:
    shelf_paint = Paint(patterns.WOOD, *palette.wood, palette.dark, 0.5)
    books = []
    for index in range(6):
        half_height = 0.13 + 0.03 * math.sin(5.0 * index)
        tint = mix(palette.toy_colors[index], palette.dark, 0.25)
        paint = Paint(
            patterns.STRIPES, tint, palette.light, tint, 2 * half_height, 0.5 + 0.2 * index
        )
        book_pose = pose @ translate(-0.26 + 0.1 * index, 0.03 + half_height, 0.02)
        books.append(box(book_pose, (0.042, half_height, 0.1), paint))
    return [box(pose, (0.4, 0.025, 0.14), shelf_paint), *books]


def make_floor_objects(phase: float, palette: Palette) -> list[list[Solid]]:
    """Return toy blocks, a cushion and a plant."""
    return [_make_blocks(phase, palette), _make_cushion(palette), _make_plant(phase, palette)]


def _make_blocks(phase: float, palette: Palette) -> list[Solid]:
    toy_colors, light = palette.toy_colors, palette.light
    poses = [
        translate(1.75, 0.13, -1.45) @ rotate_y(0.3 + phase),
        translate(2.05, 0.13, -1.30) @ rotate_y(1.0 - phase),
        translate(1.90, 0.39, -1.38) @ rotate_y(0.7 + 2 * phase),
    ]
    return [
        box(
            pose,
            (0.13, 0.13, 0.13),
            Paint(patterns.BLOCK, toy_colors[2 * index], light, toy_colors[2 * index + 1]),
        )
        for index, pose in enumerate(poses)
    ]


def _make_cushion(palette: Palette) -> list[Solid]:
    tint, dark_tint = palette.toy_colors[1], mix(palette.toy_colors[1], palette.dark, 0.4)
    paint = Paint(patterns.STRIPES, tint, dark_tint, tint, 0.13)
    pose = translate(-2.75, 0.2, -0.55) @ rotate_z(0.15)
    return [ellipsoid(pose, (0.48, 0.24, 0.48), paint)]


def _make_plant(phase: float, palette: Palette) -> list[Solid]:
    pose = translate(2.75, 0.0, -2.0)
    pot_paint = Paint(
        patterns.STRIPES, palette.toy_colors[0], palette.light, palette.light, 0.2, 0.25, 0.1
    )
    light_green, dark_green = (0.16, 0.36, 0.10), (0.07, 0.2, 0.06)
    leaf_paint = Paint(patterns.WOOD, light_green, dark_green, dark_green, 0.5, phase, 0.15)
    leaves = []
    for index in range(9):
        leaf_rotation = rotate_y(2.4 * index + phase) @ rotate_x(0.25 + 0.11 * index)
        radii = (0.085, 0.32 - 0.012 * index, 0.03)
        leaves.append(
            ellipsoid(
                pose @ translate(0, 0.4, 0) @ leaf_rotation @ translate(0, 0.3, 0),
                radii,
                leaf_paint,
            )
        )
    return [cylinder(pose @ translate(0.0, 0.2, 0.0), 0.19, 0.2, pot_paint), *leaves]
