from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.encoder.ranges import Checked, Count, Share


@dataclass(frozen=True, slots=True)
class _Settings(Checked):
    steps: Count = 1
    share: Share = 0.5
    name: str = "free"


@given(st.integers(-10, 10), st.floats(-1, 2))
def test_numbers_within_the_bounds_of_their_types_pass_and_no_others(steps, share):
    if steps >= 0 and 0 <= share <= 1:
        assert _Settings(steps, share) == _Settings(steps=steps, share=share)
    else:
        with pytest.raises(ValueError, match=r"^(steps|share) takes"):
            _Settings(steps, share)


def test_what_is_no_number_is_refused():
    with pytest.raises(ValueError, match="share"):
        _Settings(share=float("nan"))
