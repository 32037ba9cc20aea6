import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.morton import deinterleave, interleave

_AXIS = st.integers(0, (1 << 21) - 1)


@given(_AXIS, _AXIS, _AXIS)
def test_a_key_interleaves_the_bits_of_x_y_and_z(x, y, z):
    key = sum(
        ((x >> b & 1) << (3 * b + 2)) | ((y >> b & 1) << (3 * b + 1)) | ((z >> b & 1) << (3 * b))
        for b in range(21)
    )

    assert interleave(np.array([[x], [y], [z]])).tolist() == [key]


@given(st.lists(st.tuples(_AXIS, _AXIS, _AXIS), min_size=1))
def test_points_are_restored_from_keys(points):
    array = np.array(points).T

    assert deinterleave(interleave(array)).tolist() == array.tolist()
