"""Bounds of the errors of encoded Gaussians, and the quantization steps that meet them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from quarc_ref.decoder import dequantize
from quarc_ref.encoder import SceneOptions
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.grids import find_common_divisor
from quarc_ref.encoder.scenes.slack import measure_slack
from quarc_ref.format.errors import EncodeError
from quarc_ref.streams import decode
from tests.encoder.scenes.encoding import encode
from tests.encoder.scenes.given import make_splats, move


def test_the_bounds_are_in_the_metadata_and_the_errors_stay_within_them():
    first_splats = make_splats()
    data, report = encode([first_splats, move(first_splats, (0.02, 0, 0))])

    assert b"position=0.002 rotation=0.02" in data
    for name, bound in report.bounds.as_dict().items():
        assert 0 <= getattr(report.errors, name) <= bound * 1.001


def test_bounds_are_wider_where_errors_are_less_visible():
    first_splats = make_splats()
    second_splats = move(first_splats, (0.006, 0, 0), angle=0.03)
    strict, _ = encode([first_splats, second_splats])
    bounds = replace(SceneOptions().bounds, position=0.002, most_slack=4)
    loose, report = encode([first_splats, second_splats], SceneOptions(bounds=bounds))

    assert len(loose) < len(strict)
    assert b"most_slack=4" in loose
    assert b"most_slack" not in strict
    slack = measure_slack(second_splats, report.bounds)
    last = dequantize(list(decode(loose))[-1])
    _, nearest = cKDTree(second_splats.positions).query(last.positions)
    errors = np.abs(second_splats.positions[nearest] - last.positions).max(axis=1)
    assert (errors <= 0.002 * slack.position[nearest] * 1.001).all()
    assert errors.max() > 0.002


def test_large_round_or_faint_gaussians_have_slack():
    splats = make_splats(5)
    splats.log_scales[:] = [(0, 0, 0), (1, 1, 1), (-1, -1, 1), (0, 0, 0.25), (0, 0, 2)]
    splats.opacities[:] = (9, 9, 9, 9, 0)
    slack = measure_slack(splats, Bounds(position=1, most_slack=4, median_scale=1))

    assert slack.position == pytest.approx([1, np.e, 1, 1, 2], rel=1e-3)
    assert slack.rotation == pytest.approx([4, 4, 1, 4, 1], rel=1e-3)


def test_a_slack_below_1_is_rejected():
    with pytest.raises(ValueError, match=r"most_slack is 0\.5"):
        Bounds(most_slack=0.5)


def test_by_default_positions_are_bounded_by_the_scale_of_the_scene():
    splats = make_splats()
    _, report = encode([splats], SceneOptions())

    median = np.exp(np.median(splats.log_scales.mean(axis=1)))
    assert report.bounds.position == pytest.approx(0.05 * median, rel=1e-5)


def test_bounds_that_are_too_narrow_for_the_extent_are_rejected():
    splats = make_splats()
    wide_splats = replace(splats, positions=splats.positions * 1e6)

    with pytest.raises(EncodeError, match="a stream cannot represent the position"):
        encode([wide_splats], SceneOptions(bounds=Bounds(position=1e-3)))


@pytest.mark.parametrize("index", [0, 2])
def test_a_position_that_no_lattice_covers_is_named_with_its_frame_and_gaussian(index):
    frames = [make_splats()] * 3
    positions = frames[index].positions.copy()
    positions[7, 1] = -1e30
    frames[index] = replace(frames[index], positions=positions)

    expected_message = rf"^frame {40 + index}: .* position of Gaussian 7, 1e\+30 units"
    with pytest.raises(EncodeError, match=expected_message):
        encode(frames, SceneOptions(first_frame=40))


@pytest.mark.parametrize("grid", [None, 1 / 4096])
@pytest.mark.parametrize("name", ["position", "rotation", "log_scale", "opacity", "sh_dc"])
def test_bounds_may_be_huge_and_tiny_ones_are_rejected(name, grid):
    splats = make_splats()
    if grid:
        splats = replace(splats, positions=np.rint(splats.positions / grid).astype("f4") * grid)
    data, _ = encode([splats, splats], SceneOptions(bounds=Bounds(**{name: 1e300})))

    assert len(list(decode(data))) == 2
    with pytest.raises(EncodeError, match=r"bound|larger errors"):
        encode([splats, splats], SceneOptions(bounds=Bounds(**{name: 1e-320})))


@pytest.mark.parametrize(("outlier_count", "divisor"), [(0, 12), (19, 12), (20, 1)])
def test_a_common_divisor_has_few_outliers(outlier_count, divisor):
    numbers = 12 * np.random.default_rng(0).integers(1, 10_000, 1000)
    numbers[:outlier_count] = 1 + 60 * numbers[:outlier_count]

    assert find_common_divisor(numbers, 1 << 40) == divisor


@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf"), 0.0])
def test_a_bound_is_a_positive_number(value):
    with pytest.raises(ValueError, match="sh_dc"):
        Bounds(sh_dc=value)
