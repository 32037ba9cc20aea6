import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.coding.probability import choose_codes, weight_of_probability_code
from quarc_ref.format.constants import PROBABILITY_CODES, WEIGHT_TOTAL
from quarc_ref.format.errors import BadProbabilityError


def test_codes_give_distinct_weights_with_probability_for_both_bits():
    weights = [weight_of_probability_code(code) for code in range(PROBABILITY_CODES)]

    assert len(set(weights)) == PROBABILITY_CODES
    assert min(weights) == 256
    assert max(weights) == WEIGHT_TOTAL - 256


def test_the_weights_match_the_specification():
    assert [weight_of_probability_code(code) for code in (0, 7, 8, 119, 120, 239)] == [
        256,
        480,
        512,
        7_864_320,
        WEIGHT_TOTAL - 256,
        WEIGHT_TOTAL - 7_864_320,
    ]


@pytest.mark.parametrize("code", range(PROBABILITY_CODES, 256))
def test_undefined_codes_are_rejected(code):
    with pytest.raises(BadProbabilityError):
        weight_of_probability_code(code)


@given(st.integers(1, 100_000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_chosen_code_costs_little_more_than_the_exact_probability(counts):
    ones, count = counts
    ideal_bits = sum(
        bit_count * math.log2(count / bit_count) for bit_count in (ones, count - ones) if bit_count
    )  # bits of an ideal coder

    (code,) = choose_codes(np.array([ones]), np.array([count])).tolist()
    weight = weight_of_probability_code(code) / WEIGHT_TOTAL
    actual_bits = -ones * math.log2(weight) - (count - ones) * math.log2(1 - weight)

    assert actual_bits <= ideal_bits * 1.004 + count * 2.5e-5 + 0.02
