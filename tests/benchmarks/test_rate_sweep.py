from dataclasses import replace

import pytest

from quarc_ref.encoder.config import EncoderConfig, StepSettings
from quarc_ref.encoder.presets import PRESETS, change_setting
from rate.hull import Point
from rate.sweep import claim_hull, list_changes


def _apply(config, changes):
    for name, value in changes:
        config = change_setting(config, name, value)
    return config


@pytest.mark.parametrize("preset", sorted(PRESETS))
def test_every_point_is_another_setting_and_the_first_is_the_default(preset):
    config = PRESETS[preset]
    configs = [_apply(config, changes) for changes in list_changes(config)]

    assert configs[0] == config
    assert len(set(configs)) == len(configs) >= 9


def test_the_rate_term_is_swept_from_a_quarter_to_four_times():
    config = EncoderConfig(rate_weight=2.0)
    weights = {_apply(config, changes).rate_weight for changes in list_changes(config)}

    assert weights == {0.5, 1.0, 2.0, 4.0, 8.0}


@pytest.mark.parametrize("spacing", [0.0, 0.5])
def test_the_rotation_step_is_swept_with_that_of_translation(spacing):
    config = replace(EncoderConfig(), steps=StepSettings(translation_spacing=spacing))
    swept = [_apply(config, changes) for changes in list_changes(config)]

    def width(each):
        return each.steps.translation_spacing or each.stream.translation_step

    factors = {(width(each) / width(config), each.stream.rotation_unity) for each in swept}
    half = 0.5 if spacing else 4 / 7
    assert factors == {(1.0, 100), (half, 200), (2.0, 50)}


def test_the_default_is_the_first_of_the_points():
    ends = [Point("less", 1.0, 20.0), Point("more", 3.0, 24.0)]

    assert claim_hull([Point("", 2.0, 23.0), *ends]).holds is True
    below = claim_hull([Point("", 2.0, 21.5), *ends])
    assert (below.value, below.holds) == (0.5, False)
