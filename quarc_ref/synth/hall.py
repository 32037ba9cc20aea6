"""An empty hall that is as large as the playroom, with a lamp above the center.

The light on the subject is identical in the bright and the black hall, because walls do not
reflect light onto it.
"""

import math

import numpy as np

from quarc_ref.synth import texture_kernels as patterns
from quarc_ref.synth.furniture import make_room
from quarc_ref.synth.paints import Paint, Palette
from quarc_ref.synth.scene_arrays import Room
from quarc_ref.synth.solids import Solid, ball, translate

_LAMP_LIGHT = (13.0, 12.2, 11.0)
_BLACK = (0.006, 0.006, 0.007)
_SMALL_LAMP_COUNT = 7


def make_hall(phase: float, palette: Palette, *, is_dark: bool) -> Room:
    """Return the hall: the playroom without furniture, and with black walls if `is_dark`."""
    room = make_room(phase, palette)
    lamp = [0.2, 3.1, 0.9, 0.35, 0.0, 0.0, 0.0, 0.0, 0.35, *_LAMP_LIGHT, 0.0, -1.0, 0.0]
    black_paint = Paint(patterns.PLAIN, _BLACK, _BLACK, _BLACK)
    paints = (black_paint,) * len(room.paints) if is_dark else room.paints
    return Room(room.faces, paints, np.array([lamp]), room.ambient)


def make_small_lamps() -> list[Solid]:
    """Return a row of small lamps at the back; the lamps are bright enough to saturate pixels."""
    white = (0.9, 0.9, 0.85)
    lamp_paint = Paint(patterns.PLAIN, white, white, white, glow=9.0)
    angles = [
        math.pi * (index / (_SMALL_LAMP_COUNT - 1) - 0.5) / 2 for index in range(_SMALL_LAMP_COUNT)
    ]
    return [ball(translate(3.2 * math.sin(angle), 2.6, -2.3), 0.07, lamp_paint) for angle in angles]
