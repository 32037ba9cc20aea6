import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.encoder.scenes.grids import find_lattice, find_step

_MIN_STEP = 1e-4


@given(
    step=st.floats(_MIN_STEP, 10),
    multiples=st.sets(st.integers(-500, 500), max_size=50),
    neighbor=st.integers(0, 500),
)
def test_the_step_of_multiples_is_found(step, multiples, neighbor):
    values = step * np.array([*multiples, neighbor, neighbor + 1])

    assert find_step(values, 0.999 * _MIN_STEP) == pytest.approx(step, rel=1e-6)
    assert find_step(values.astype(np.float32), 0.999 * _MIN_STEP) == pytest.approx(step, rel=1e-4)


def test_values_off_the_grid_have_no_step():
    values = np.arange(100) * 0.25
    values[7] += 0.01

    assert find_step(values, _MIN_STEP) is None
    assert find_step(np.zeros(9), _MIN_STEP) is None


def test_a_step_below_the_minimum_is_not_detected():
    assert find_step(np.arange(9) * 0.6 * _MIN_STEP, _MIN_STEP) is None


@given(
    exponent=st.integers(0, 20), multiples=st.lists(st.integers(-999, 999)), odd=st.integers(0, 9)
)
def test_the_lattice_of_coordinates_is_found_up_to_its_largest_multiple(exponent, multiples, odd):
    coordinates = [np.array(multiples or [0]), np.array([2 * odd + 1])]
    positions = [array / 2**exponent for array in coordinates]
    largest = max(np.abs(array).max() for array in coordinates)

    assert find_lattice(positions, largest) == exponent
    assert find_lattice(positions, largest - 1) is None


def test_coordinates_that_are_no_binary_fractions_have_no_lattice():
    assert find_lattice([np.array([0.1])], 1e18) is None
