import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.coding.pricing import saves_bits
from quarc_ref.format.constants import WEIGHT_TOTAL

_WEIGHTS = st.integers(256, WEIGHT_TOTAL - 256)


def _bits(zeros, ones, weight):
    share = weight / WEIGHT_TOTAL
    return -zeros * math.log2(1 - share) - ones * math.log2(share)


@given(st.integers(0, 5000), st.integers(0, 5000), _WEIGHTS, _WEIGHTS)
def test_a_probability_is_stated_if_it_saves_more_than_its_14_bits(zeros, ones, known, fitting):
    saved = _bits(zeros, ones, known) - _bits(zeros, ones, fitting)

    reported = saves_bits(*(np.array([number]) for number in (zeros, ones, known, fitting)))

    assert bool(reported[0]) == (saved > 14) or math.isclose(saved, 14, abs_tol=1e-6)
