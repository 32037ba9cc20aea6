"""An empty hall of the size of the playroom, lit by a lamp above its center.

The light on the subject is identical in the bright and the black hall: it comes only from lamps
and surroundings, without interreflection.
"""

import math

import numpy as np

from quarc_ref.synth import texture_kernels as patterns
from quarc_ref.synth.furniture import make_room
from quarc_ref.synth.paints import Paint, Palette
from quarc_ref.synth.solids import Solid, at, ball
from quarc_ref.synth.stage import Room

_SPOT = (13.0, 12.2, 11.0)
_BLACK = (0.006, 0.006, 0.007)
_LAMP_COUNT = 7


def make_hall(phase: float, palette: Palette, *, dark: bool) -> Room:
    """Return the hall: the playroom without furniture, or with black walls."""
    room = make_room(phase, palette)
    spot = [0.2, 3.1, 0.9, 0.35, 0.0, 0.0, 0.0, 0.0, 0.35, *_SPOT, 0.0, -1.0, 0.0]
    black = Paint(patterns.PLAIN, _BLACK, _BLACK, _BLACK)
    paints = (black,) * len(room.paints) if dark else room.paints
    return Room(room.faces, paints, np.array([spot]), room.ambient)


def make_lamps() -> list[Solid]:
    """Return a row of small lamps at the back, whose brightness saturates pictures."""
    white = (0.9, 0.9, 0.85)
    glow = Paint(patterns.PLAIN, white, white, white, glow=9.0)
    angles = [math.pi * (place / (_LAMP_COUNT - 1) - 0.5) / 2 for place in range(_LAMP_COUNT)]
    return [ball(at(3.2 * math.sin(a), 2.6, -2.3), 0.07, glow) for a in angles]
