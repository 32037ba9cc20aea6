from math import isqrt

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from plain import oracle
from quarc_ref.format import arithmetic

_NUMERATORS = st.integers(-(1 << 60), 1 << 60)
_DENOMINATORS = st.integers(1, 1 << 60)


@given(_NUMERATORS, _DENOMINATORS)
@example(1, 2)
@example(-1, 2)
@example(-3, 2)
@example(1 << 60, 1 << 60)
def test_divide_round_rounds_to_the_nearest_with_halves_away_from_zero(numerator, denominator):
    quotient = arithmetic.divide_round(np.array([numerator]), denominator)

    assert quotient.tolist() == [oracle.divide_round(numerator, denominator)]


@given(st.integers(0, 1 << 62))
@example(1 << 62)
@example((1 << 62) - 1)
@example(((1 << 31) - 1) ** 2)
@example(((1 << 31) - 1) ** 2 - 1)
@example(0)
def test_isqrt_is_the_floor_of_the_root(value):
    assert arithmetic.isqrt(np.array([value])).tolist() == [isqrt(value)]


@given(st.integers(0, (1 << 62) - 1))
@example(0)
@example(1)
@example((1 << 61) - 1)
@example(1 << 61)
def test_bit_length_equals_python_integers(value):
    assert arithmetic.bit_length(np.array([value])).tolist() == [value.bit_length()]
