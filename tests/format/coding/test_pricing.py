import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.coding.pricing import saves_bits
from quarc_ref.format.constants import WEIGHT_TOTAL

_WEIGHTS = st.integers(256, WEIGHT_TOTAL - 256)


def _ideal_bits(zeros, ones, weight):
    probability = weight / WEIGHT_TOTAL
    return -zeros * math.log2(1 - probability) - ones * math.log2(probability)


@given(st.integers(0, 5000), st.integers(0, 5000), _WEIGHTS, _WEIGHTS)
def test_a_probability_is_stated_if_it_saves_more_than_its_14_bits(
    zeros, ones, context_weight, fitted_weight
):
    saved_bits = _ideal_bits(zeros, ones, context_weight) - _ideal_bits(zeros, ones, fitted_weight)

    reported = saves_bits(
        *(np.array([number]) for number in (zeros, ones, context_weight, fitted_weight))
    )

    assert bool(reported[0]) == (saved_bits > 14) or math.isclose(saved_bits, 14, abs_tol=1e-6)
