import numpy as np
import pytest

from quarc_ref.evaluation.comparison.bd_rate import compare_curves

# The example in the documentation of `bjontegaard`: two presets of libx265.
_REFERENCE_CURVE = list(
    zip([9487.76, 4593.60, 2486.44, 1358.24], [40.037, 38.615, 36.845, 34.851], strict=True)
)
_TEST_CURVE = list(
    zip([9787.80, 4469.00, 2451.52, 1356.24], [40.121, 38.651, 36.970, 34.987], strict=True)
)


def test_the_example_of_the_package_is_reproduced():
    delta = compare_curves(_REFERENCE_CURVE, _TEST_CURVE)

    assert delta.rate == pytest.approx(-4.4252, abs=1e-4)
    assert delta.quality == pytest.approx(0.1194, abs=1e-4)
    assert delta.remark == ""


def test_half_the_bytes_at_equal_quality_give_minus_50_percent_in_any_order_and_unit():
    rates = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    quality = [30.0, 32.0, 33.5, 34.5, 35.0]
    reference = list(zip(rates, quality, strict=True))
    halved = [(rates[index] / 2, quality[index]) for index in (2, 0, 4, 1, 3)]

    assert compare_curves(reference, halved).rate == pytest.approx(-50)
    assert compare_curves(halved, reference).rate == pytest.approx(100)


def test_three_rates_are_too_few():
    delta = compare_curves(_REFERENCE_CURVE, _TEST_CURVE[:3])

    assert (delta.rate, delta.quality) == (None, None)
    assert "3 points of known size; 4 are needed" in delta.remark


def test_a_falling_curve_is_rejected():
    delta = compare_curves([*_REFERENCE_CURVE, (20000.0, 30.0)], _TEST_CURVE)

    assert delta.rate is None
    assert "does not increase" in delta.remark


@pytest.mark.parametrize(
    ("rate", "remark"), [(0.0, "a point of 0 bytes"), (4593.60, "two points of the same rate")]
)
def test_a_curve_that_cannot_be_interpolated_is_rejected(rate, remark):
    curve = [*_REFERENCE_CURVE[1:], (rate, 33.0)]

    assert remark in compare_curves(curve, _TEST_CURVE).remark
    assert remark in compare_curves(_TEST_CURVE, curve).remark


def test_curves_with_little_overlap_get_a_remark_and_those_without_have_no_figure():
    higher = [(rate, quality + 3) for rate, quality in _TEST_CURVE]
    disjoint = [(rate, quality + 30) for rate, quality in _TEST_CURVE]

    assert "Insufficient curve overlap" in compare_curves(_REFERENCE_CURVE, higher).remark
    assert compare_curves(_REFERENCE_CURVE, disjoint).rate is None
    assert "do not overlap" in compare_curves(_REFERENCE_CURVE, disjoint).remark
