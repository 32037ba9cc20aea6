import math
import random
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.encoder.frames.rate_control import control_rate, price_bytes
from quarc_ref.encoder.settings.presets import PRESETS, change_setting, choose_preset

sizes_so_far = st.lists(st.integers(0, 1 << 30), max_size=60)
targets = st.floats(1, 1e8)


def _encode(target: float, elasticity: float, dearth: float, noise: float, seed: int) -> list[int]:
    """The sizes that a toy encoder makes of 40 frames, its content rising and falling."""
    draws, sizes = random.Random(seed), []
    for frame in range(40):
        content = math.exp(0.3 * math.sin(frame / 6) + draws.gauss(0, noise))
        factor = control_rate(sizes, target)
        sizes.append(60 + round(dearth * target * content * factor**-elasticity))
    return sizes


@given(
    target=st.floats(1000, 1e6),
    elasticity=st.floats(0.6, 1.6),
    dearth=st.floats(0.2, 5),
    seed=st.integers(0, 1 << 16),
)
def test_the_mean_meets_the_target_whatever_the_content(target, elasticity, dearth, seed):
    sizes = _encode(target, elasticity, dearth, 0.1, seed)

    assert sum(sizes) / len(sizes) == pytest.approx(target, rel=0.05)


@given(sizes_so_far, targets)
def test_the_factor_is_bounded_whatever_was_written(sizes, target):
    assert 1 / 257 < control_rate(sizes, target) < 257


@given(st.lists(st.integers(0, 1 << 30), min_size=1, max_size=60), targets)
def test_a_frame_changes_the_factor_by_no_more_than_three(sizes, target):
    before, after = control_rate(sizes[:-1], target), control_rate(sizes, target)

    assert 1 / 3.01 < after / before < 3.01


@given(targets)
def test_the_first_frame_costs_what_the_settings_say(target):
    assert control_rate([], target) == 1


@pytest.mark.parametrize("name", PRESETS)
def test_without_a_target_the_sizes_do_not_matter(name):
    config = choose_preset(name)

    assert price_bytes(config, [1, 1 << 20]) == config


def test_rate_weight_multiplies_every_price_of_a_frame():
    config = change_setting(choose_preset("main"), "births.rd_lambda", "1e-6")
    priced = price_bytes(change_setting(config, "rd_lambda", "3"), [])

    assert priced.motion.rd_lambda == pytest.approx(3 * config.motion.rd_lambda)
    assert priced.births.rd_lambda == pytest.approx(3e-6)


def test_prices_are_shares_of_the_loss_of_frame_0_but_the_papers():
    main, paper = (
        price_bytes(choose_preset(name), [], reference_loss=0.01) for name in ("main", "paper")
    )

    assert main.motion.rd_lambda == pytest.approx(0.01 * choose_preset("main").motion.rd_lambda)
    assert main.births.rd_lambda == pytest.approx(0.01 * choose_preset("main").births.rd_lambda)
    assert paper.motion.rd_lambda == choose_preset("paper").motion.rd_lambda


@pytest.mark.parametrize(("quality", "factor"), [("50", 1), ("30", 2), ("90", 0.25), ("10", 4)])
def test_twenty_more_of_quality_halve_every_price(quality, factor):
    config = choose_preset("main")

    priced = price_bytes(change_setting(config, "quality", quality), [])

    assert priced.motion.rd_lambda == pytest.approx(factor * config.motion.rd_lambda)
    assert priced.births.rd_lambda == pytest.approx(factor * config.births.rd_lambda)
    assert priced.updates.rd_lambda == pytest.approx(factor * config.updates.rd_lambda)
    assert priced.updates.min_gain == pytest.approx(factor * config.updates.min_gain)
    assert priced.canonical.code_rd_lambda == pytest.approx(
        factor * config.canonical.code_rd_lambda
    )
    assert priced.canonical.prune_rd_lambda == pytest.approx(
        factor * config.canonical.prune_rd_lambda
    )


def test_too_large_frames_make_the_next_one_dearer():
    config = change_setting(choose_preset("main"), "target_kb_per_frame", "2")

    dear, cheap = (price_bytes(config, [size] * 3).motion.rd_lambda for size in (4096, 1024))
    assert dear > config.motion.rd_lambda > cheap


def test_canonical_prices_are_as_dear_as_bytes():
    config = change_setting(choose_preset("main"), "rd_lambda", "3")
    config = change_setting(config, "canonical.prune_rd_lambda", "0.5")
    config = change_setting(config, "canonical.code_rd_lambda", "0.01")

    priced = price_bytes(config, []).canonical

    assert priced == replace(config.canonical, prune_rd_lambda=1.5, code_rd_lambda=0.03)
