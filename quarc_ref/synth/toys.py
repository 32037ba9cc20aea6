"""Moving objects: ball, crate, blob, mobile, balloon and train.

Each function returns the solids of an object at a time in seconds. Phases are in turns and
depend on the seed. At 160x120, most objects move by 0.5 to 3 pixels per frame, and the ball by
at most 7.
"""

import math

from quarc_ref.synth import texture_kernels as patterns
from quarc_ref.synth.paints import Paint, Palette
from quarc_ref.synth.room_kernels import TRACK_RADIUS
from quarc_ref.synth.solids import (
    Matrix,
    Solid,
    ball,
    blob,
    box,
    capsule,
    cylinder,
    ellipsoid,
    rotate_x,
    rotate_y,
    rotate_z,
    scale,
    translate,
)

_BALL_RADIUS = 0.2
_BOUNCE_SECONDS = 0.66
_BOUNCE_HEIGHT = 0.38
_CONTACT_SHARE = 0.14  # share of a bounce, on each side of the impact, that deforms the ball
_TRAIN_SPEED = 1.2  # meters per second
_CAR_SPACING = 0.47
_WHEEL_RADIUS = 0.065


def wave(time: float, period: float, phase: float) -> float:
    """Return the value of a sine wave, given its period in seconds and its phase in turns."""
    return math.sin(2 * math.pi * (time / period + phase))


def make_ball(time: float, phase: float, palette: Palette) -> list[Solid]:
    """Return a bouncing beach ball, which is deformed when it hits the floor."""
    bounce_phase = (time / _BOUNCE_SECONDS + phase) % 1.0
    impact = max(0.0, 1 - (min(bounce_phase, 1 - bounce_phase) / _CONTACT_SHARE) ** 2) ** 2
    speed = abs(2 * bounce_phase - 1)
    stretch = 1 + 0.16 * speed * (1 - impact) - 0.34 * impact
    widening = 1 / math.sqrt(stretch)
    height = _BOUNCE_HEIGHT * 4 * bounce_phase * (1 - bounce_phase) + _BALL_RADIUS * stretch
    x = 0.62 * wave(time, 3.4, phase)
    z = 0.72 + 0.1 * wave(time, 2.3, 2 * phase)
    pose = (
        translate(x, height, z) @ scale(widening, stretch, widening) @ rotate_z(-x / _BALL_RADIUS)
    )
    pose = pose @ rotate_x(0.9 + 0.7 * time) @ rotate_z(0.4)
    first, second, third = palette.toy_colors[0], palette.toy_colors[2], palette.toy_colors[4]
    paint = Paint(patterns.BEACH_BALL, first, second, third, phase=phase, gloss=0.3)
    return [ball(pose, _BALL_RADIUS, paint)]


def make_crate(time: float, phase: float, palette: Palette) -> list[Solid]:
    """Return a crate on a turntable."""
    pose = translate(-0.93, 0.0, -0.4) @ rotate_y(2.0 * time + 2 * math.pi * phase)
    top_paint = Paint(
        patterns.CHECKS, palette.toy_colors[3], palette.light, palette.light, 0.12, gloss=0.2
    )
    board_paint = Paint(patterns.CRATE, *palette.wood, palette.dark, phase=phase, gloss=0.1)
    crate_pose = pose @ translate(0.0, 0.35, 0.0) @ rotate_y(0.4)
    return [
        cylinder(pose @ translate(0.0, 0.06, 0.0), 0.33, 0.06, top_paint),
        box(crate_pose, (0.23, 0.23, 0.23), board_paint),
        box(
            crate_pose @ translate(0.03, 0.29, 0.02) @ rotate_y(0.5),
            (0.13, 0.06, 0.09),
            _make_book_paint(palette),
        ),
    ]


def _make_book_paint(palette: Palette) -> Paint:
    return Paint(patterns.STRIPES, palette.toy_colors[5], palette.light, palette.light, 0.12, 0.5)


def make_blob(time: float, phase: float, palette: Palette) -> list[Solid]:
    """Return a wobbling blob on a stool."""
    pose = translate(0.95, 0.0, -0.5)
    breath = 1 + 0.07 * wave(time, 1.1, phase)
    paint = Paint(
        patterns.DOTS, palette.toy_colors[1], palette.light, palette.light, 0.17, phase, 0.35
    )
    sway = rotate_z(0.2 * wave(time, 1.3, phase)) @ rotate_y(1.2 * time)
    radii = (0.25 / math.sqrt(breath), 0.25 * breath, 0.25 / math.sqrt(breath))
    wave_phase = 0.65 * time + phase
    return [
        blob(pose @ translate(0.0, 0.67, 0.0) @ sway, radii, wave_phase, paint),
        *_make_stool(pose, palette),
    ]


def _make_stool(pose: Matrix, palette: Palette) -> list[Solid]:
    seat_paint = Paint(patterns.WOOD, *palette.wood, palette.dark, 0.5, gloss=0.1)
    leg_paint = Paint(
        patterns.PLAIN, palette.toy_colors[4], palette.dark, palette.dark, 0.3, gloss=0.2
    )
    legs = []
    for index in range(3):
        leg_pose = pose @ rotate_y(2 * math.pi * index / 3)
        legs.append(
            capsule(
                leg_pose @ translate(0, 0.40, 0.12),
                leg_pose @ translate(0, 0.03, 0.24),
                0.035,
                leg_paint,
            )
        )
    return [cylinder(pose @ translate(0.0, 0.43, 0.0), 0.25, 0.035, seat_paint), *legs]


def make_mobile(time: float, phase: float, palette: Palette) -> list[Solid]:
    """Return a rotating mobile above the stage: a planet, a box, a pill and a ball."""
    hub = translate(0.15, 1.78, -0.75) @ rotate_y(1.5 * time + 2 * math.pi * phase)
    rod_paint = Paint(patterns.PLAIN, palette.dark, palette.dark, palette.dark)
    toy_colors = palette.toy_colors
    planet_paint = Paint(
        patterns.STRIPES, toy_colors[3], palette.light, toy_colors[3], 0.16, phase, 0.25
    )
    box_paint = Paint(patterns.CHECKS, toy_colors[4], palette.light, toy_colors[4], 0.11, 0.0, 0.2)
    pill_paint = Paint(
        patterns.STRIPES, toy_colors[0], toy_colors[2], toy_colors[0], 0.9, 0.25, 0.25
    )
    ball_paint = Paint(patterns.PLAIN, toy_colors[5], toy_colors[5], toy_colors[5], 0.1, phase, 0.3)
    lower, upper = translate(0, -0.22, 0), translate(0, -0.14, 0)
    ends = [hub @ rotate_y(math.pi / 2 * index) @ translate(0.0, 0.0, 0.6) for index in range(4)]
    solids = [
        *(capsule(hub, end, 0.013, rod_paint) for end in ends),
        ellipsoid(ends[0] @ lower @ rotate_z(0.4), (0.11, 0.11, 0.11), planet_paint),
        box(ends[1] @ upper @ rotate_y(1.1 * time), (0.085, 0.085, 0.085), box_paint),
        capsule(ends[2] @ lower, ends[2] @ upper @ translate(0.09, 0.05, 0), 0.06, pill_paint),
        ball(ends[3] @ upper, 0.09, ball_paint),
    ]
    return [*solids, capsule(hub, hub @ translate(0.0, 0.8, 0.0), 0.013, rod_paint)]


def make_balloon(time: float, palette: Palette) -> list[Solid]:
    """Return a balloon that crosses the stage in about half a second."""
    x = -3.4 + 6.8 * (time - 0.1) / 0.45
    pose = translate(min(max(x, -3.4), 3.4), 1.05 + 0.15 * wave(time, 0.5, 0.0), 0.55)
    drop = 0.0 if -3.4 < x < 3.4 else 6.0  # below the floor
    paint = Paint(
        patterns.DOTS, palette.toy_colors[0], palette.light, palette.light, 0.2, gloss=0.4
    )
    string_paint = Paint(patterns.PLAIN, palette.dark, palette.dark, palette.dark)
    pose = translate(0.0, -drop, 0.0) @ pose @ rotate_z(0.3 * wave(time, 0.4, 0.0))
    return [
        ellipsoid(pose, (0.2, 0.25, 0.2), paint),
        capsule(pose @ translate(0, -0.25, 0), pose @ translate(0, -0.6, 0), 0.012, string_paint),
    ]


def make_train(time: float, phase: float, palette: Palette) -> list[list[Solid]]:
    """Return an engine and two wagons that drive around the stage."""
    angle = _TRAIN_SPEED * time / TRACK_RADIUS + 2 * math.pi * (0.18 + 0.64 * phase)
    roll = -_TRAIN_SPEED * time / _WHEEL_RADIUS
    cars = []
    for index in range(3):
        pose = rotate_y(angle - index * _CAR_SPACING / TRACK_RADIUS) @ translate(
            0.0, 0.0, TRACK_RADIUS
        )
        body = (
            _make_engine(pose, palette) if index == 0 else _make_wagon(pose, index, phase, palette)
        )
        cars.append([*body, *_make_wheels(pose, roll, palette)])
    return cars


def _make_engine(pose: Matrix, palette: Palette) -> list[Solid]:
    first, second, third = palette.toy_colors[0], palette.toy_colors[3], palette.toy_colors[2]
    body_paint = Paint(patterns.PLAIN, first, first, first, 0.2, gloss=0.25)
    cab_paint = Paint(patterns.BLOCK, second, second, palette.light, gloss=0.2)
    boiler_paint = Paint(patterns.STRIPES, first, third, third, 0.11, 0.3, 0.3)
    chimney_paint = Paint(patterns.PLAIN, palette.dark, palette.dark, palette.dark, gloss=0.2)
    lamp_paint = Paint(patterns.PLAIN, palette.light, third, third, glow=0.5)
    return [
        box(pose @ translate(0.0, 0.1, 0.0), (0.2, 0.035, 0.1), body_paint),
        cylinder(
            pose @ translate(0.07, 0.215, 0.0) @ rotate_z(math.pi / 2), 0.085, 0.12, boiler_paint
        ),
        box(pose @ translate(-0.115, 0.25, 0.0), (0.075, 0.115, 0.095), cab_paint),
        box(pose @ translate(-0.115, 0.38, 0.0), (0.1, 0.018, 0.115), body_paint),
        cylinder(pose @ translate(0.13, 0.33, 0.0), 0.035, 0.06, chimney_paint),
        ball(pose @ translate(0.19, 0.215, 0.0), 0.05, lamp_paint),
    ]


def _make_wagon(pose: Matrix, index: int, phase: float, palette: Palette) -> list[Solid]:
    first, second = palette.toy_colors[1 + 3 * (index - 1)], palette.toy_colors[5 - 3 * (index - 1)]
    side_paint = Paint(patterns.CHECKS, first, palette.light, first, 0.095, gloss=0.15)
    floor_paint = Paint(patterns.WOOD, *palette.wood, palette.dark, 0.3, phase)
    load_paint = Paint(patterns.PLAIN, second, second, second, 0.12, phase, 0.3)
    balls = [
        ball(pose @ translate(0.115 * slot, 0.25, 0.0), 0.072, load_paint) for slot in (-1, 0, 1)
    ]
    return [
        box(pose @ translate(0.0, 0.09, 0.0), (0.22, 0.025, 0.1), floor_paint),
        box(pose @ translate(0.0, 0.165, 0.0), (0.19, 0.05, 0.095), side_paint),
        *balls,
    ]


def _make_wheels(pose: Matrix, roll: float, palette: Palette) -> list[Solid]:
    paint = Paint(patterns.RINGS, palette.dark, palette.toy_colors[2], palette.dark, gloss=0.2)
    return [
        cylinder(
            pose @ translate(x, _WHEEL_RADIUS, z) @ rotate_x(math.pi / 2) @ rotate_y(roll),
            _WHEEL_RADIUS,
            0.022,
            paint,
        )
        for x in (-0.12, 0.12)
        for z in (-0.1, 0.1)
    ]
