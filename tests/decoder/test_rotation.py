import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from plain import oracle
from quarc_ref.decoder.rotation import expand_rotations, normalize_sums, rotate
from quarc_ref.format.errors import DegenerateRotationError, RotationRangeError

_SUM = st.integers(-(1 << 10), 1 << 10)
_SUMS = st.tuples(_SUM, _SUM, _SUM, _SUM)


@given(_SUMS)
def test_sums_are_normalized_as_in_plain_integers(sums):
    assume(any(sums))

    unit = normalize_sums(np.array(sums)[:, None])

    assert unit[:, 0].tolist() == oracle.normalize(list(sums), 20)
    assert abs(sum(int(v) ** 2 for v in unit[:, 0]) - (1 << 44)) <= 1 << 24


@given(_SUMS, _SUMS)
def test_a_rotation_matches_plain_integers(first, second):
    assume(any(first))
    assume(any(second))
    rotation = normalize_sums(np.array(first)[:, None]).astype(np.int32)

    rotated = rotate(rotation, normalize_sums(np.array(second)[:, None]))

    assert rotated[:, 0].tolist() == oracle.rotate(rotation[:, 0].tolist(), list(second))


def test_the_residual_is_on_the_right():
    quarter_x, quarter_z = np.array([[1, 1, 0, 0], [1, 0, 0, 1]]).T[:, :, None].transpose(1, 0, 2)
    rotated = rotate(normalize_sums(quarter_x).astype(np.int32), normalize_sums(quarter_z))

    assert np.sign(rotated[:, 0]).tolist() == [1, 1, -1, 1]


def test_a_sum_of_zero_is_rejected():
    with pytest.raises(DegenerateRotationError):
        normalize_sums(np.array([[1, 0], [0, 0], [0, 0], [0, 0]]))


@given(st.integers(1, 14), st.data())
def test_rotation_codes_are_expanded_as_in_plain_integers(bits, data):
    component = st.integers(-(1 << bits), 1 << bits)
    components = data.draw(st.tuples(component, component, component))
    largest = data.draw(st.integers(0, 3))
    coded = np.array([largest, *components])[:, None]
    if sum(v * v for v in components) > 1 << (2 * bits):
        with pytest.raises(RotationRangeError):
            expand_rotations(coded, bits)
        return

    expanded = expand_rotations(coded, bits)

    assert expanded[:, 0].tolist() == oracle.expand_rotation(largest, list(components), bits)


def test_a_component_far_out_of_range_is_rejected_before_it_is_squared():
    with pytest.raises(RotationRangeError):
        expand_rotations(np.array([[0], [(1 << 15) - 1], [0], [0]]), 1)
