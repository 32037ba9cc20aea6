import math

import numpy as np
import pytest

from quarc_ref.synth.paints import Paint
from quarc_ref.synth.solids import (
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

_PAINT = Paint(0, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_FRAME = translate(1.0, 2.0, 3.0) @ rotate_y(0.7) @ rotate_x(0.4)


@pytest.mark.parametrize(
    ("rotate", "start", "end"), [(rotate_x, 1, 2), (rotate_y, 2, 0), (rotate_z, 0, 1)]
)
def test_a_quarter_turn_maps_an_axis_to_the_next(rotate, start, end):
    rotated = rotate(math.pi / 2) @ np.eye(4)[:, start]

    np.testing.assert_allclose(rotated, np.eye(4)[:, end], atol=1e-12)


@pytest.mark.parametrize(
    ("solid", "radius"),
    [
        (ball(_FRAME, 0.5, _PAINT), 0.5),
        (ball(_FRAME @ scale(1.0, 2.0, 1.0), 0.5, _PAINT), 1.0),
        (ellipsoid(_FRAME, (0.1, 0.2, 0.7), _PAINT), 0.7),
        (box(_FRAME, (0.3, 0.4, 1.2), _PAINT), 1.3),
        (cylinder(_FRAME, 0.3, 0.4, _PAINT), 0.5),
        (blob(_FRAME, (0.25, 0.25, 0.25), 0.3, _PAINT), 0.33),
    ],
)
def test_bounds_are_a_sphere_around_the_solid(solid, radius):
    np.testing.assert_allclose(solid.bounds(), (1, 2, 3, radius))


def test_a_capsule_includes_its_caps():
    solid = capsule(translate(0.0, 0.0, 0.0), translate(0.6, 0.0, 0.8), 0.1, _PAINT)
    ends = solid.matrix @ np.array([[0, -solid.parameter, 0, 1], [0, solid.parameter, 0, 1]]).T

    np.testing.assert_allclose(ends[:3].T, [[0, 0, 0], [0.6, 0, 0.8]], atol=1e-12)
    np.testing.assert_allclose(solid.bounds(), (0.3, 0.0, 0.4, 0.6), atol=1e-12)
