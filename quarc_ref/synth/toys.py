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
_CONTACT_SHARE = 0.14  # share of a bounce before and after the impact in which the ball is deformed
_TRAIN_SPEED = 1.2
_WAGON_LENGTH = 0.47
_WHEEL_RADIUS = 0.065


def wave(time: float, seconds: float, phase: float) -> float:
    """Return the value of a sine wave, given its period in seconds and its phase in turns."""
    return math.sin(2 * math.pi * (time / seconds + phase))


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
    frame = (
        translate(x, height, z) @ scale(widening, stretch, widening) @ rotate_z(-x / _BALL_RADIUS)
    )
    frame = frame @ rotate_x(0.9 + 0.7 * time) @ rotate_z(0.4)
    first, second, third = palette.toys[0], palette.toys[2], palette.toys[4]
    paint = Paint(patterns.GORES, first, second, third, phase=phase, gloss=0.3)
    return [ball(frame, _BALL_RADIUS, paint)]


def make_crate(time: float, phase: float, palette: Palette) -> list[Solid]:
    """Return a crate on a turntable."""
    frame = translate(-0.93, 0.0, -0.4) @ rotate_y(2.0 * time + 2 * math.pi * phase)
    top = Paint(patterns.CHECKS, palette.toys[3], palette.light, palette.light, 0.12, gloss=0.2)
    boards = Paint(patterns.CRATE, *palette.wood, palette.dark, phase=phase, gloss=0.1)
    crate = frame @ translate(0.0, 0.35, 0.0) @ rotate_y(0.4)
    return [
        cylinder(frame @ translate(0.0, 0.06, 0.0), 0.33, 0.06, top),
        box(crate, (0.23, 0.23, 0.23), boards),
        box(
            crate @ translate(0.03, 0.29, 0.02) @ rotate_y(0.5),
            (0.13, 0.06, 0.09),
            _make_book_paint(palette),
        ),
    ]


def _make_book_paint(palette: Palette) -> Paint:
    return Paint(patterns.STRIPES, palette.toys[5], palette.light, palette.light, 0.12, 0.5)


def make_blob(time: float, phase: float, palette: Palette) -> list[Solid]:
    """Return a wobbling blob on a stool."""
    frame = translate(0.95, 0.0, -0.5)
    breath = 1 + 0.07 * wave(time, 1.1, phase)
    paint = Paint(patterns.DOTS, palette.toys[1], palette.light, palette.light, 0.17, phase, 0.35)
    sway = rotate_z(0.2 * wave(time, 1.3, phase)) @ rotate_y(1.2 * time)
    radii = (0.25 / math.sqrt(breath), 0.25 * breath, 0.25 / math.sqrt(breath))
    waves = 0.65 * time + phase
    return [
        blob(frame @ translate(0.0, 0.67, 0.0) @ sway, radii, waves, paint),
        *_make_stool(frame, palette),
    ]


def _make_stool(frame: Matrix, palette: Palette) -> list[Solid]:
    wood = Paint(patterns.WOOD, *palette.wood, palette.dark, 0.5, gloss=0.1)
    leg = Paint(patterns.PLAIN, palette.toys[4], palette.dark, palette.dark, 0.3, gloss=0.2)
    legs = []
    for index in range(3):
        leg_frame = frame @ rotate_y(2 * math.pi * index / 3)
        legs.append(
            capsule(
                leg_frame @ translate(0, 0.40, 0.12),
                leg_frame @ translate(0, 0.03, 0.24),
                0.035,
                leg,
            )
        )
    return [cylinder(frame @ translate(0.0, 0.43, 0.0), 0.25, 0.035, wood), *legs]


def make_mobile(time: float, phase: float, palette: Palette) -> list[Solid]:
    """Return a rotating mobile above the stage: a planet, a box, a pill and a ball."""
    hub = translate(0.15, 1.78, -0.75) @ rotate_y(1.5 * time + 2 * math.pi * phase)
    rod = Paint(patterns.PLAIN, palette.dark, palette.dark, palette.dark)
    toys = palette.toys
    stripes = Paint(patterns.STRIPES, toys[3], palette.light, toys[3], 0.16, phase, 0.25)
    checks = Paint(patterns.CHECKS, toys[4], palette.light, toys[4], 0.11, 0.0, 0.2)
    pill = Paint(patterns.STRIPES, toys[0], toys[2], toys[0], 0.9, 0.25, 0.25)
    plain = Paint(patterns.PLAIN, toys[5], toys[5], toys[5], 0.1, phase, 0.3)
    lower, higher = translate(0, -0.22, 0), translate(0, -0.14, 0)
    ends = [hub @ rotate_y(math.pi / 2 * index) @ translate(0.0, 0.0, 0.6) for index in range(4)]
    solids = [
        *(capsule(hub, end, 0.013, rod) for end in ends),
        ellipsoid(ends[0] @ lower @ rotate_z(0.4), (0.11, 0.11, 0.11), stripes),
        box(ends[1] @ higher @ rotate_y(1.1 * time), (0.085, 0.085, 0.085), checks),
        capsule(ends[2] @ lower, ends[2] @ higher @ translate(0.09, 0.05, 0), 0.06, pill),
        ball(ends[3] @ higher, 0.09, plain),
    ]
    return [*solids, capsule(hub, hub @ translate(0.0, 0.8, 0.0), 0.013, rod)]


def make_balloon(time: float, palette: Palette) -> list[Solid]:
    """Return a balloon that crosses the stage in about half a second."""
    x = -3.4 + 6.8 * (time - 0.1) / 0.45
    frame = translate(min(max(x, -3.4), 3.4), 1.05 + 0.15 * wave(time, 0.5, 0.0), 0.55)
    drop = 0.0 if -3.4 < x < 3.4 else 6.0  # below the floor
    paint = Paint(patterns.DOTS, palette.toys[0], palette.light, palette.light, 0.2, gloss=0.4)
    string = Paint(patterns.PLAIN, palette.dark, palette.dark, palette.dark)
    frame = translate(0.0, -drop, 0.0) @ frame @ rotate_z(0.3 * wave(time, 0.4, 0.0))
    return [
        ellipsoid(frame, (0.2, 0.25, 0.2), paint),
        capsule(frame @ translate(0, -0.25, 0), frame @ translate(0, -0.6, 0), 0.012, string),
    ]


def make_train(time: float, phase: float, palette: Palette) -> list[list[Solid]]:
    """Return an engine and two wagons that drive around the stage."""
    angle = _TRAIN_SPEED * time / TRACK_RADIUS + 2 * math.pi * (0.18 + 0.64 * phase)
    roll = -_TRAIN_SPEED * time / _WHEEL_RADIUS
    cars = []
    for index in range(3):
        frame = rotate_y(angle - index * _WAGON_LENGTH / TRACK_RADIUS) @ translate(
            0.0, 0.0, TRACK_RADIUS
        )
        body = (
            _make_engine(frame, palette)
            if index == 0
            else _make_wagon(frame, index, phase, palette)
        )
        cars.append([*body, *_make_wheels(frame, roll, palette)])
    return cars


def _make_engine(frame: Matrix, palette: Palette) -> list[Solid]:
    first, second, third = palette.toys[0], palette.toys[3], palette.toys[2]
    body = Paint(patterns.PLAIN, first, first, first, 0.2, gloss=0.25)
    cab = Paint(patterns.BLOCK, second, second, palette.light, gloss=0.2)
    boiler = Paint(patterns.STRIPES, first, third, third, 0.11, 0.3, 0.3)
    dark = Paint(patterns.PLAIN, palette.dark, palette.dark, palette.dark, gloss=0.2)
    lamp = Paint(patterns.PLAIN, palette.light, third, third, glow=0.5)
    return [
        box(frame @ translate(0.0, 0.1, 0.0), (0.2, 0.035, 0.1), body),
        cylinder(frame @ translate(0.07, 0.215, 0.0) @ rotate_z(math.pi / 2), 0.085, 0.12, boiler),
        box(frame @ translate(-0.115, 0.25, 0.0), (0.075, 0.115, 0.095), cab),
        box(frame @ translate(-0.115, 0.38, 0.0), (0.1, 0.018, 0.115), body),
        cylinder(frame @ translate(0.13, 0.33, 0.0), 0.035, 0.06, dark),
        ball(frame @ translate(0.19, 0.215, 0.0), 0.05, lamp),
    ]


def _make_wagon(frame: Matrix, index: int, phase: float, palette: Palette) -> list[Solid]:
    first, second = palette.toys[1 + 3 * (index - 1)], palette.toys[5 - 3 * (index - 1)]
    side = Paint(patterns.CHECKS, first, palette.light, first, 0.095, gloss=0.15)
    floor = Paint(patterns.WOOD, *palette.wood, palette.dark, 0.3, phase)
    load = Paint(patterns.PLAIN, second, second, second, 0.12, phase, 0.3)
    balls = [ball(frame @ translate(0.115 * slot, 0.25, 0.0), 0.072, load) for slot in (-1, 0, 1)]
    return [
        box(frame @ translate(0.0, 0.09, 0.0), (0.22, 0.025, 0.1), floor),
        box(frame @ translate(0.0, 0.165, 0.0), (0.19, 0.05, 0.095), side),
        *balls,
    ]


def _make_wheels(frame: Matrix, roll: float, palette: Palette) -> list[Solid]:
    paint = Paint(patterns.RINGS, palette.dark, palette.toys[2], palette.dark, gloss=0.2)
    return [
        cylinder(
            frame @ translate(x, _WHEEL_RADIUS, z) @ rotate_x(math.pi / 2) @ rotate_y(roll),
            _WHEEL_RADIUS,
            0.022,
            paint,
        )
        for x in (-0.12, 0.12)
        for z in (-0.1, 0.1)
    ]
