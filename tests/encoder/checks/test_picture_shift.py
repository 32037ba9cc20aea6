import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.encoder.checks.picture_shift import ReferencePicture
from tests.encoder.checks.shaken_scenes import move, paint_wall

_WALL = paint_wall()
_REFERENCE = ReferencePicture(_WALL)
_shifts = st.floats(-8, 8)


@given(_shifts, _shifts, st.floats(0.5, 1.1))
def test_shifts_are_measured(x, y, gain):
    shift = _REFERENCE.measure_shift(gain * move(_WALL, x, y))

    assert shift == pytest.approx((x, y), abs=0.15)


@given(_shifts, _shifts)
def test_a_shifted_picture_is_told_from_another(x, y):
    shift = np.array([x, y])
    if np.hypot(x, y) > 0.3:
        assert _REFERENCE.is_shifted(move(_WALL, x, y), shift)
        assert not _REFERENCE.is_shifted(_WALL, shift)


def test_contrast_is_relative_and_does_not_depend_on_shifts():
    assert _REFERENCE.measure_contrast(_WALL / 4) == pytest.approx(0.25)
    assert _REFERENCE.measure_contrast(move(_WALL, 7, -3)) == pytest.approx(1, abs=0.05)
    assert _REFERENCE.measure_contrast(np.full_like(_WALL, 90)) == 0


def test_a_wall_of_one_color_or_with_a_few_details_has_no_texture():
    few = np.full_like(_WALL, 80)
    few[8:16, 8:24] = _WALL[8:16, 8:24]

    assert _REFERENCE.has_texture
    assert not ReferencePicture(few).has_texture
    assert not ReferencePicture(np.full_like(_WALL, 80)).has_texture
    stripes = np.repeat(_WALL[:1], len(_WALL), axis=0)
    assert not ReferencePicture(stripes).has_texture
