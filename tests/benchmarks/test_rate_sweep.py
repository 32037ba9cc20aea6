from dataclasses import replace

import pytest

from quarc_ref.encoder.encode_stream import adapt_steps_to_capture
from quarc_ref.encoder.settings.config import EncoderConfig, StepSettings
from quarc_ref.encoder.settings.presets import PRESETS, change_setting
from rate.hull import Point
from rate.sweep import claim_hull, fix_steps, list_changes
from tests.encoder.toys import make_capture

_CAPTURE = make_capture()


def _apply(config, changes):
    for name, value in changes:
        config = change_setting(config, name, value)
    return config


def _fix_steps(preset):
    return _apply(PRESETS[preset], fix_steps(PRESETS[preset], _CAPTURE))


@pytest.mark.parametrize("preset", sorted(PRESETS))
def test_fixed_steps_are_those_adapted_to_the_capture(preset):
    adapted = adapt_steps_to_capture(PRESETS[preset], _CAPTURE)

    assert _fix_steps(preset) == replace(adapted, steps=StepSettings())


@pytest.mark.parametrize("preset", sorted(PRESETS))
def test_every_point_is_another_setting_and_the_first_is_the_default(preset):
    config = _fix_steps(preset)
    configs = [_apply(config, changes) for _, changes in list_changes(config)]

    assert configs[0] == config
    assert len(set(configs)) == len(configs) >= 9
    assert len({label for label, _ in list_changes(config)}) == len(configs)


@pytest.mark.parametrize("preset", sorted(PRESETS))
def test_no_point_trains_another_frame_0(preset):
    config = _fix_steps(preset)

    def canonical(each):
        motion = {"translation_step": 1, "rotation_unity": 1, "gaussians_per_anchor": 1}
        return each.canonical, each.rd_lambda, each.seed, replace(each.stream, **motion)

    swept = [_apply(config, changes) for _, changes in list_changes(config)]
    assert all(canonical(each) == canonical(config) for each in swept)


def test_the_rate_term_is_swept_from_a_quarter_to_four_times():
    config = PRESETS["main"]
    swept = [_apply(config, changes) for _, changes in list_changes(config)]

    def dear(each):
        motion, births = each.motion, each.births
        return {
            round(motion.rd_lambda / config.motion.rd_lambda, 6),
            round(births.rd_lambda / config.births.rd_lambda, 6),
        }

    assert [dear(each) for each in swept[:5]] == [{1.0}, {0.25}, {0.5}, {2.0}, {4.0}]
    assert all(dear(each) == {1.0} for each in swept[5:])


def test_the_rotation_step_is_swept_with_that_of_translation():
    config = EncoderConfig()
    swept = [_apply(config, changes) for _, changes in list_changes(config)]

    step = config.stream.translation_step
    factors = {(each.stream.translation_step / step, each.stream.rotation_unity) for each in swept}
    assert factors == {(1.0, 100), (4 / 7, 200), (2.0, 50)}


def test_the_default_is_the_first_of_the_points():
    ends = [Point("less", 1.0, 20.0), Point("more", 3.0, 24.0)]

    assert claim_hull([Point("", 2.0, 23.0), *ends]).holds is True
    below = claim_hull([Point("", 2.0, 21.5), *ends])
    assert (below.value, below.holds) == (0.5, False)
