import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quality.spreads import (
    Difference,
    Spread,
    average_differences,
    subtract,
    summarize,
    summarize_figures,
)

_NUMBERS = st.floats(-1e3, 1e3)
_SEEDS = st.lists(_NUMBERS, min_size=2, max_size=8)


@given(values=_SEEDS)
def test_a_spread_is_the_mean_and_deviation_of_a_sample(values):
    spread = summarize(values)

    assert spread.mean == pytest.approx(np.mean(values), abs=1e-9)
    assert spread.deviation == pytest.approx(np.std(values, ddof=1), abs=1e-9)
    assert spread.count == len(values)


@given(value=_NUMBERS)
def test_a_single_seed_has_no_deviation(value):
    assert summarize([value]) == Spread(value, None, 1)
    assert summarize([value]).variance_of_mean is None


@given(values=_SEEDS, shift=_NUMBERS)
def test_a_shift_changes_only_the_mean(values, shift):
    difference = subtract(summarize([value + shift for value in values]), summarize(values))

    assert difference.amount == pytest.approx(shift, abs=1e-6)
    error = math.sqrt(2 * np.var(values, ddof=1) / len(values))
    assert difference.error == pytest.approx(error, abs=1e-6)


@given(ours=_SEEDS, theirs=_SEEDS)
def test_a_reversed_difference_has_the_opposite_sign_and_the_same_error(ours, theirs):
    there, back = (
        subtract(summarize(first), summarize(second))
        for first, second in ((ours, theirs), (theirs, ours))
    )

    assert there.amount == -back.amount
    assert there.error == pytest.approx(back.error)


@given(values=_SEEDS, single=_NUMBERS)
def test_a_single_seed_gives_no_error(values, single):
    assert subtract(summarize(values), summarize([single])).error is None


@given(
    differences=st.lists(st.builds(Difference, _NUMBERS, st.floats(0, 10)), min_size=1, max_size=6)
)
def test_errors_of_several_captures_average_out(differences):
    mean = average_differences(differences)

    assert mean.amount == pytest.approx(np.mean([it.amount for it in differences]), abs=1e-9)
    squares = sum(it.error**2 for it in differences)
    assert mean.error == pytest.approx(math.sqrt(squares) / len(differences))


def test_an_unknown_error_makes_the_error_of_the_mean_unknown():
    differences = [Difference(1.0, 0.1), Difference(2.0, None)]

    assert average_differences(differences) == Difference(1.5, None)


@given(values=st.lists(st.none() | _NUMBERS, min_size=1, max_size=8))
def test_rows_without_a_figure_are_not_counted(values):
    spreads = summarize_figures([{"x": value, "y": 1.0} for value in values])
    found = [value for value in values if value is not None]

    assert spreads["y"].count == len(values)
    assert ("x" in spreads) == bool(found)
    if found:
        assert spreads["x"] == summarize(found)
