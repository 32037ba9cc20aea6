"""Tests of the finding about a missed target of rate control."""

import pytest

from quarc_ref.encoder.checks.target_check import check_target


@pytest.mark.parametrize(
    ("frame_sizes", "target_kb"),
    [([1100, 1140], 1.0), ([10, 20], 1.0), ([9000], 0.0), ([], 1.0)],
    ids=["close", "below", "no target", "only keyframes"],
)
def test_sizes_that_are_close_or_below_give_no_finding(frame_sizes, target_kb):
    assert list(check_target(frame_sizes, target_kb)) == []


def test_sizes_above_the_target_give_a_finding():
    (finding,) = check_target([4096, 2048], 1.5)

    assert finding.kind == "target-exceeded"
    assert "3.00 KB on average, more than the target of 1.5 KB" in finding.message
    assert "the last frame: 2.00 KB" in finding.message
