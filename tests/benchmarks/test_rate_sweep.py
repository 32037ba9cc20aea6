from dataclasses import replace

import pytest

from quarc_ref.encoder.adapt_steps import adapt_steps_to_capture
from quarc_ref.encoder.settings.config import EncoderConfig, StepSettings
from quarc_ref.encoder.settings.presets import PRESETS, change_setting
from rate.hull import Point
from rate.sweep import list_fixed_steps, list_variations, make_hull_claim
from tests.encoder.toys import make_capture

_CAPTURE = make_capture()


def _apply_changes(config, changes):
    for name, value in changes:
        config = change_setting(config, name, value)
    return config


def _fix_steps(preset):
    return _apply_changes(PRESETS[preset], list_fixed_steps(PRESETS[preset], _CAPTURE))


def test_fixed_steps_are_those_adapted_to_the_capture():
    config = _apply_changes(PRESETS["main"], [("steps.translation_error", "0")])
    adapted = adapt_steps_to_capture(config, _CAPTURE)

    fixed = _apply_changes(config, list_fixed_steps(config, _CAPTURE))
    assert fixed == replace(adapted, steps=StepSettings())


def test_a_step_that_depends_on_the_error_of_frame_0_is_swept_as_its_share_of_the_error():
    config = PRESETS["main"]
    swept_configs = [_apply_changes(config, changes) for _, changes in list_variations(config)]

    assert list_fixed_steps(config, _CAPTURE) == ()
    shares = {point_config.steps.translation_error for point_config in swept_configs}
    assert shares == {0.125, 0.25, 0.5}


@pytest.mark.parametrize("preset", sorted(PRESETS))
def test_every_point_is_another_setting_and_the_first_is_the_default(preset):
    config = _fix_steps(preset)
    configs = [_apply_changes(config, changes) for _, changes in list_variations(config)]

    assert configs[0] == config
    assert len(set(configs)) == len(configs) >= 9
    assert len({label for label, _ in list_variations(config)}) == len(configs)


@pytest.mark.parametrize("preset", sorted(PRESETS))
def test_no_point_trains_another_frame_0(preset):
    config = _fix_steps(preset)

    def get_canonical_inputs(point_config):
        motion = {"translation_step": 1, "rotation_unity": 1, "gaussians_per_anchor": 1}
        return (
            point_config.canonical,
            point_config.rd_lambda,
            point_config.seed,
            replace(adapt_steps_to_capture(point_config, _CAPTURE).stream, **motion),
        )

    swept_configs = [_apply_changes(config, changes) for _, changes in list_variations(config)]
    assert all(
        get_canonical_inputs(point_config) == get_canonical_inputs(config)
        for point_config in swept_configs
    )


def test_the_rate_term_is_swept_from_a_quarter_to_four_times():
    config = PRESETS["main"]
    swept_configs = [_apply_changes(config, changes) for _, changes in list_variations(config)]

    def list_lambda_factors(point_config):
        motion, births = point_config.motion, point_config.births
        return {
            round(motion.rd_lambda / config.motion.rd_lambda, 6),
            round(births.rd_lambda / config.births.rd_lambda, 6),
        }

    assert [list_lambda_factors(point_config) for point_config in swept_configs[:5]] == [
        {1.0},
        {0.25},
        {0.5},
        {2.0},
        {4.0},
    ]
    assert all(list_lambda_factors(point_config) == {1.0} for point_config in swept_configs[5:])


def test_the_rotation_step_is_swept_with_that_of_translation():
    config = EncoderConfig()
    swept_configs = [_apply_changes(config, changes) for _, changes in list_variations(config)]

    step = config.stream.translation_step
    factors = {
        (point_config.stream.translation_step / step, point_config.stream.rotation_unity)
        for point_config in swept_configs
    }
    assert factors == {(1.0, 100), (4 / 7, 200), (2.0, 50)}


def test_the_default_is_the_first_of_the_points():
    other_points = [Point("less", 1.0, 20.0), Point("more", 3.0, 24.0)]

    assert make_hull_claim([Point("", 2.0, 23.0), *other_points]).holds is True
    claim = make_hull_claim([Point("", 2.0, 21.5), *other_points])
    assert (claim.value, claim.holds) == (0.5, False)
