"""Kernels for painted surfaces: the robot's face, the pictures on the wall and the screen."""

# mypy: allow-untyped-defs

import math

from quarc_ref.synth.compiled import kernel
from quarc_ref.synth.noise_kernels import blend, ramp, shade


@kernel
def paint_face(colors, x, y, z):
    """Return the color of a head that faces +z, with eyes, cheeks and a smile."""
    first, second, third = colors
    if z < 0.25:
        return first
    distance_from_middle, height_above_eyes = abs(x), y - 0.12
    eye_distance = math.hypot(distance_from_middle - 0.36, height_above_eyes)
    if math.hypot(distance_from_middle - 0.40, height_above_eyes - 0.07) < 0.09:
        return 0.92, 0.92, 0.92
    if eye_distance < 0.24:
        return third
    if math.hypot(distance_from_middle - 0.62, height_above_eyes + 0.38) < 0.15:
        return second
    smile_distance = abs(math.hypot(x, y + 0.02) - 0.46)
    if smile_distance < 0.075 and y < -0.25:
        return third
    return first


@kernel
def paint_landscape(colors, phase, x, y):
    """Return the color of a picture of hills and the sun; x and y range from -1 to 1."""
    near_color, far_color, sky_color = colors
    sun_distance = math.hypot(x - 0.6 * math.cos(5 * phase), 0.8 * (y - 0.35))
    far_hill_height = -0.1 + 0.22 * math.sin(2.3 * x + phase) + 0.1 * math.sin(4.1 * x - 2 * phase)
    near_hill_height = -0.55 + 0.2 * math.sin(1.9 * x - 1.3 * phase)
    color = blend(shade(sky_color, 1.05), shade(sky_color, 0.7), ramp(y, 0.1, 1.0))
    color = blend((0.9, 0.78, 0.35), color, ramp(sun_distance, 0.26, 0.32))
    color = blend(far_color, color, ramp(y - far_hill_height, -0.04, 0.04))
    return blend(near_color, color, ramp(y - near_hill_height, -0.04, 0.04))


@kernel
def paint_screen(colors, wipe, x, y):
    """Return the color of a screen on which a second picture wipes over the first one.

    Args:
        colors: Background color of both pictures, and two colors of the shapes in them.
        wipe: Share of the screen, from the left, that shows the second picture.
        x: Horizontal coordinate from -1 to 1.
        y: Vertical coordinate from -1 to 1.
    """
    if max(abs(x), abs(y)) > 0.92:
        return 0.05, 0.05, 0.06
    first_picture, second_picture = (
        _paint_disk_and_bars(colors, x, y),
        _paint_star_and_waves(colors, x, y),
    )
    edge = -1.1 + 2.2 * wipe
    return blend(second_picture, first_picture, ramp(x, edge - 0.03, edge + 0.03))


@kernel
def _paint_disk_and_bars(colors, x, y):
    background, shape_color, accent_color = colors
    if math.hypot(1.4 * (x + 0.42), y) < 0.55:
        return accent_color if math.hypot(1.4 * (x + 0.42), y) < 0.25 else shape_color
    bar_top = -0.5 + 0.45 * math.floor(5 * (x - 0.15)) / 2
    bar_position = 5 * (x - 0.15) - math.floor(5 * (x - 0.15))
    is_in_bar = x > 0.15 and -0.7 < y < bar_top and 0.15 < bar_position < 0.85
    return shape_color if is_in_bar else background


@kernel
def _paint_star_and_waves(colors, x, y):
    background, shape_color, accent_color = colors
    r, angle = math.hypot(1.5 * (x - 0.3), y), math.atan2(y, 1.5 * (x - 0.3))
    if r < 0.42 + 0.16 * math.cos(5 * angle):
        return background
    wave_position = 2.2 * (y + 0.18 * math.sin(4 * x))
    return (
        accent_color
        if (wave_position - math.floor(wave_position)) < 0.5
        else shade(shape_color, 0.6)
    )
