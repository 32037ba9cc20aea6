from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.encoder.settings.ranges import (
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    UnitInterval,
    Validated,
)


@dataclass(frozen=True, slots=True)
class _Settings(Validated):
    steps: NonNegativeInt = 1
    share: UnitInterval = 0.5
    weight: PositiveFloat = 1.0
    amount: NonNegativeFloat = 0.0
    name: str = "free"


@given(st.integers(-10, 10), st.floats(-1, 2))
def test_numbers_within_the_bounds_of_their_types_pass_and_no_others(steps, share):
    if steps >= 0 and 0 <= share <= 1:
        assert _Settings(steps, share) == _Settings(steps=steps, share=share)
    else:
        with pytest.raises(ValueError, match=r"^(steps|share) takes"):
            _Settings(steps, share)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"weight": 0.0}, "weight takes a number above 0, not 0.0"),
        ({"amount": float("inf")}, "amount takes a number of at least 0, not inf"),
        ({"share": 2.0}, "share takes a number from 0 to 1, not 2.0"),
        ({"steps": -1}, "steps takes an integer of at least 0, not -1"),
    ],
)
def test_the_range_of_a_number_is_described_in_words(changes, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        _Settings(**changes)


def test_a_value_that_is_not_a_number_is_rejected():
    with pytest.raises(ValueError, match="share"):
        _Settings(share=float("nan"))
