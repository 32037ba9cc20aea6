import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.encoder.frames.rate_control import RateDistortion, choose_rd_factor, control_rate
from quarc_ref.encoder.settings.presets import PRESETS, change_setting, choose_preset

sizes_so_far = st.lists(st.integers(0, 1 << 30), max_size=60)
targets = st.floats(1, 1e8)


def _encode(
    target: float, elasticity: float, content_factor: float, noise: float, seed: int
) -> list[int]:
    """Return the sizes of 40 frames from a model of an encoder whose content varies."""
    rng, sizes = random.Random(seed), []
    for frame in range(40):
        content = math.exp(0.3 * math.sin(frame / 6) + rng.gauss(0, noise))
        factor = control_rate(sizes, target)
        sizes.append(60 + round(content_factor * target * content * factor**-elasticity))
    return sizes


@given(
    target=st.floats(1000, 1e6),
    elasticity=st.floats(0.6, 1.6),
    content_factor=st.floats(0.2, 5),
    seed=st.integers(0, 1 << 16),
)
def test_the_mean_meets_the_target_for_any_content(target, elasticity, content_factor, seed):
    sizes = _encode(target, elasticity, content_factor, 0.1, seed)

    assert sum(sizes) / len(sizes) == pytest.approx(target, rel=0.05)


@given(sizes_so_far, targets)
def test_the_factor_is_bounded_for_any_sizes(sizes, target):
    assert 1 / 257 < control_rate(sizes, target) < 257


@given(st.lists(st.integers(0, 1 << 30), min_size=1, max_size=60), targets)
def test_a_frame_changes_the_factor_by_at_most_three(sizes, target):
    previous_factor, factor = control_rate(sizes[:-1], target), control_rate(sizes, target)

    assert 1 / 3.01 < factor / previous_factor < 3.01


@given(targets)
def test_the_first_frame_uses_the_lambda_of_the_settings(target):
    assert control_rate([], target) == 1


@pytest.mark.parametrize("name", PRESETS)
def test_without_a_target_sizes_are_ignored(name):
    assert choose_rd_factor(choose_preset(name), [1, 1 << 20]) == 1


def test_lambda_is_a_factor_as_is_the_rate_control():
    config = change_setting(choose_preset("main"), "rd_lambda", "3")
    assert choose_rd_factor(config, []) == 3

    config = change_setting(config, "target_kb_per_frame", "2")
    assert choose_rd_factor(config, [4096] * 3) == 3 * control_rate([4096] * 3, 2048)


@pytest.mark.parametrize(("quality", "factor"), [("50", 1), ("30", 2), ("90", 0.25), ("10", 4)])
def test_increasing_quality_by_twenty_halves_lambda(quality, factor):
    config = change_setting(choose_preset("main"), "quality", quality)

    assert choose_rd_factor(config, []) == pytest.approx(factor)


def test_too_large_frames_raise_lambda_for_the_next_one():
    config = change_setting(choose_preset("main"), "target_kb_per_frame", "2")

    assert choose_rd_factor(config, [4096] * 3) > 1 > choose_rd_factor(config, [1024] * 3)


def test_weights_are_relative_to_the_loss_of_frame_0_or_absolute():
    rd = RateDistortion(3.0, 0.01)

    assert rd.scale_relative(0.5) == pytest.approx(0.015)
    assert rd.scale_absolute(0.5) == 1.5
