import pytest

from quarc_ref.cli.encoder_options import format_settings, make_config
from quarc_ref.cli.errors import UsageError
from quarc_ref.encoder.settings.presets import choose_preset


def test_a_preset_without_settings_is_unchanged():
    assert make_config("paper", [], 0) == choose_preset("paper")


def test_the_seed_is_an_option_and_a_setting():
    assert make_config("main", [], 5).seed == 5
    assert make_config("main", ["seed=7"], 0).seed == 7


def test_the_last_of_two_values_of_a_setting_counts():
    config = make_config("main", ["motion.lr=1", "births.iterations=3", "motion.lr=2"], 0)

    assert config.motion.lr == 2
    assert config.births.iterations == 3


def test_options_change_their_settings_and_missing_options_none():
    changes = format_settings(
        {"rd_lambda": 2.5, "target_kb_per_frame": None, "canonical.keyframe_interval": 30}
    )
    config = make_config("main", changes, 0)

    assert (config.rd_lambda, config.target_kb_per_frame) == (2.5, 0)
    assert config.canonical.keyframe_interval == 30


@pytest.mark.parametrize("setting", ["motion.lr", "", "=1", "motion=1", "motion.lr=", "a=b=c"])
def test_an_unknown_setting_is_a_usage_error(setting):
    with pytest.raises(UsageError):
        make_config("main", [setting], 0)
