from pathlib import Path
from types import SimpleNamespace

import pytest

from quarc_ref.datasets.frame_numbers import compare_first_numbers


def _compare(*numbers):
    """Compare cameras a, b, ..., whose pictures have these numbers."""
    paths = [[Path(f"frame_{number:04}.png") for number in camera] for camera in numbers]
    return compare_first_numbers("abcdef"[: len(numbers)], SimpleNamespace(paths=paths))


@pytest.mark.parametrize(("first", "offset"), [(4, "-2"), (-4, "2")])
def test_an_offset_is_in_frames_even_if_numbers_have_larger_steps(first, offset):
    usual = range(100, 140, 2)
    (finding,) = _compare(usual, range(100 + first, 140 + first, 2), usual)

    assert finding.cameras == ("b",)
    assert f'("offsets": {{"b": {offset}}})' in finding.message


@pytest.mark.parametrize(("first", "is_named"), [(5, True), (6, False)])
def test_cameras_that_count_on_their_own_are_not_named(first, is_named):
    findings = _compare(range(10), range(10), range(first, first + 10))

    assert [finding.cameras for finding in findings] == [("c",)] * is_named
