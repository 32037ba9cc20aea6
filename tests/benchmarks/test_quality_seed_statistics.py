import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quality.seed_statistics import (
    Difference,
    Statistics,
    average_differences,
    subtract,
    summarize,
    summarize_figures,
)

_FIGURES = st.floats(-1e3, 1e3)
_SEED_FIGURES = st.lists(_FIGURES, min_size=2, max_size=8)


@given(values=_SEED_FIGURES)
def test_statistics_are_the_mean_and_deviation_of_a_sample(values):
    statistics = summarize(values)

    assert statistics.mean == pytest.approx(np.mean(values), abs=1e-9)
    assert statistics.deviation == pytest.approx(np.std(values, ddof=1), abs=1e-9)
    assert statistics.count == len(values)


@given(value=_FIGURES)
def test_a_single_seed_has_no_deviation(value):
    assert summarize([value]) == Statistics(value, None, 1)
    assert summarize([value]).variance_of_mean is None


@given(values=_SEED_FIGURES, shift=_FIGURES)
def test_a_shift_changes_only_the_mean(values, shift):
    difference = subtract(summarize([value + shift for value in values]), summarize(values))

    assert difference.amount == pytest.approx(shift, abs=1e-6)
    error = math.sqrt(2 * np.var(values, ddof=1) / len(values))
    assert difference.error == pytest.approx(error, abs=1e-6)


@given(first_values=_SEED_FIGURES, second_values=_SEED_FIGURES)
def test_a_reversed_difference_has_the_opposite_sign_and_the_same_error(
    first_values, second_values
):
    difference, reversed_difference = (
        subtract(summarize(minuend), summarize(subtrahend))
        for minuend, subtrahend in ((first_values, second_values), (second_values, first_values))
    )

    assert difference.amount == -reversed_difference.amount
    assert difference.error == pytest.approx(reversed_difference.error)


@given(values=_SEED_FIGURES, single_value=_FIGURES)
def test_a_single_seed_gives_no_error(values, single_value):
    assert subtract(summarize(values), summarize([single_value])).error is None


@given(
    differences=st.lists(st.builds(Difference, _FIGURES, st.floats(0, 10)), min_size=1, max_size=6)
)
def test_errors_of_several_captures_average_out(differences):
    mean = average_differences(differences)

    assert mean.amount == pytest.approx(
        np.mean([difference.amount for difference in differences]), abs=1e-9
    )
    squared_errors = sum(difference.error**2 for difference in differences)
    assert mean.error == pytest.approx(math.sqrt(squared_errors) / len(differences))


def test_an_unknown_error_makes_the_error_of_the_mean_unknown():
    differences = [Difference(1.0, 0.1), Difference(2.0, None)]

    assert average_differences(differences) == Difference(1.5, None)


@given(values=st.lists(st.none() | _FIGURES, min_size=1, max_size=8))
def test_rows_without_a_figure_are_not_counted(values):
    statistics_by_name = summarize_figures([{"x": value, "y": 1.0} for value in values])
    existing_values = [value for value in values if value is not None]

    assert statistics_by_name["y"].count == len(values)
    assert ("x" in statistics_by_name) == bool(existing_values)
    if existing_values:
        assert statistics_by_name["x"] == summarize(existing_values)
