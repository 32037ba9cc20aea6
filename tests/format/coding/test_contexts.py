from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.constants import COUNT_LIMIT, WEIGHT_TOTAL

_CONTEXTS = np.array([0, 5, 900])
_BIT_COUNTS = st.lists(
    st.tuples(st.integers(0, 9000), st.integers(0, 9000)), min_size=3, max_size=3
)


def _count_planes(*planes):
    counts = ContextCounts()
    for plane in planes:
        counts.add_bits("some", _CONTEXTS, *np.array(plane).T)
    return counts


def _weight(zeros, ones):
    return int(Fraction(2 * ones + 1, 2 * (zeros + ones) + 2) * WEIGHT_TOTAL)


@given(st.lists(_BIT_COUNTS, max_size=4))
def test_the_weight_follows_from_the_counts_which_are_halved_when_too_large(planes):
    expected_counts = [(0, 0)] * 3
    for plane in planes:
        expected_counts = [
            _halve_counts(a + c, b + d)
            for (a, b), (c, d) in zip(expected_counts, plane, strict=True)
        ]

    weights = _count_planes(*planes).compute_weights("some", _CONTEXTS)

    assert weights.tolist() == [_weight(*counts) for counts in expected_counts]


def _halve_counts(zeros, ones):
    while zeros + ones > COUNT_LIMIT:
        zeros, ones = zeros // 2, ones // 2
    return zeros, ones


@given(_BIT_COUNTS)
def test_a_weight_leaves_probability_for_both_bits(plane):
    weights = _count_planes(plane).compute_weights("some", _CONTEXTS)

    assert 0 < weights.min() <= weights.max() < WEIGHT_TOTAL


def test_a_new_context_gives_both_bits_the_same_probability():
    assert _count_planes([(9, 0)] * 3).compute_weights("other", np.array([7])).tolist() == [
        WEIGHT_TOTAL // 2
    ]
    assert _count_planes([(9, 0)] * 3).compute_weights("some", np.array([6, 9000])).tolist() == (
        [WEIGHT_TOTAL // 2] * 2
    )


def test_a_copy_is_independent():
    original = _count_planes([(3, 1)] * 3)
    initial_weights = original.compute_weights("some", _CONTEXTS).tolist()

    duplicate = original.copy()
    duplicate.add_bits("some", _CONTEXTS, np.array([0, 0, 0]), np.array([50, 50, 50]))

    assert original.compute_weights("some", _CONTEXTS).tolist() == initial_weights
    assert duplicate.compute_weights("some", _CONTEXTS).tolist() != initial_weights
