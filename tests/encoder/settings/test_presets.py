from dataclasses import replace

import pytest

from quarc_ref.encoder import EncodeOptions
from quarc_ref.encoder.settings.config import (
    BirthSettings,
    CanonicalSettings,
    EncoderConfig,
    StepSettings,
    make_header,
)
from quarc_ref.encoder.settings.presets import (
    PRESETS,
    SettingError,
    change_setting,
    choose_preset,
    list_settings,
)


def test_paper_is_what_the_paper_states():
    paper = choose_preset("paper")

    assert paper.canonical == CanonicalSettings(iterations=15_000, quantize_from=1.0)
    assert (paper.canonical.noise, paper.canonical.dssim) == (0.01, 0.2)
    assert (paper.motion.iterations, paper.motion.rate, paper.motion.momentum) == (100, 5e-4, 0.6)
    assert (paper.motion.price, paper.motion.price_weight) == ("l1", 1.0)
    assert paper.births == BirthSettings(iterations=100)
    assert (paper.stream.gaussians_per_anchor, paper.stream.anchor_ratio) == (4, 3)
    assert (paper.stream.rotation_components, paper.stream.resample_interval) == (4, 2)
    assert paper.steps == StepSettings()


@pytest.mark.parametrize("name", ["log_scale_step", "opacity_step", "sh_dc_step", "sh_rest_step"])
def test_the_papers_attribute_steps_are_a_hundredth_to_float_precision(name):
    assert getattr(choose_preset("paper").stream, name) == pytest.approx(0.01, rel=1e-7)


def test_no_setting_means_the_main_preset():
    assert EncodeOptions().config == choose_preset("main")


@pytest.mark.parametrize(
    ("path", "text", "value"),
    [
        ("motion.rate", "5e-3", 5e-3),
        ("canonical.iterations", "7", 7),
        ("births.split_at", "10,20,30", (10, 20, 30)),
        ("births.split_at", "", ()),
        ("births.must_pay", "no", False),
        ("motion.price", "l1", "l1"),
        ("stream.translation_step", "3", 3),
        ("seed", "12", 12),
    ],
)
def test_a_leaf_can_be_changed_by_its_name(path, text, value):
    changed = change_setting(choose_preset("main"), path, text)

    assert dict(list_settings(changed))[path] == value


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("canonical.iterations", "0"),
        ("canonical.densify_every", "0"),
        ("canonical.position_rate_end", "0"),
        ("motion.iterations", "-1"),
        ("motion.rate", "nan"),
        ("motion.rate", "inf"),
        ("births.max_births", "-1"),
        ("births.deaths_below", "1.1"),
        ("stream.gaussians_per_anchor", "0"),
        ("stream.log_scale_step", "nan"),
        ("seed", str(1 << 64)),
    ],
)
def test_a_value_out_of_range_is_refused_by_name(path, text):
    with pytest.raises(SettingError, match=f"^{path}={text}: {path.split('.')[-1]} "):
        change_setting(choose_preset("main"), path, text)


def test_changing_a_leaf_leaves_all_others():
    before = dict(list_settings(choose_preset("main")))
    after = dict(list_settings(change_setting(choose_preset("main"), "motion.rate", "0.5")))

    assert {name for name in before if before[name] != after[name]} == {"motion.rate"}


@pytest.mark.parametrize(
    ("path", "text", "said"),
    [
        ("motion.rat", "1", "motion.rate"),
        ("rate", "1", "close to it: motion.rate, updates.rate; "),
        ("motion", "1", "no setting"),
        ("", "1", "no setting"),
        ("motion.iterations", "many", "motion.iterations=many"),
        ("births.must_pay", "perhaps", "true, false"),
        ("motion.price", "l2", "l1, group_log"),
        ("births.split_at", "a,b", "births.split_at"),
        ("stream.level_count", "9", "level_count"),
    ],
)
def test_what_cannot_be_set_is_said(path, text, said):
    with pytest.raises(SettingError, match=said):
        change_setting(choose_preset("main"), path, text)


@pytest.mark.parametrize(
    ("path", "text", "takes"),
    [
        ("canonical.iterations", "1.5", "a whole number from 1 on"),
        ("motion.rate", "abc", "a number from 0 on"),
        ("motion.dssim", "", "a number from 0 to 1"),
        ("rate_weight", "much", "a number above 0"),
        ("stream.level_count", "1.5", "a whole number"),
        ("stream.opacity_step", "x", "a number"),
        ("births.must_pay", "perhaps", "true, false"),
        ("births.split_at", "1,b", "whole numbers with commas between them"),
        ("births.placement", "here", "gate, errors"),
    ],
)
def test_what_no_value_can_be_made_of_is_told_what_the_setting_takes(path, text, takes):
    with pytest.raises(SettingError) as caught:
        change_setting(choose_preset("main"), path, text)

    assert str(caught.value) == f"{path}={text}: it takes {takes}"


def test_an_unknown_preset_names_those_there_are():
    with pytest.raises(SettingError, match="paper"):
        choose_preset("best")


@pytest.mark.parametrize("config", PRESETS.values(), ids=PRESETS)
def test_a_header_can_be_made_of_every_preset(config: EncoderConfig):
    header = make_header(config, 29.97, 40_000)

    assert header.frames_per_second == pytest.approx(29.97, rel=1e-5)
    assert header.level == 10


@pytest.mark.parametrize(
    ("count", "level"), [(61_000, 10), (62_000, 20), (1 << 18, 30), (1 << 20, 31)]
)
def test_the_level_bears_the_scene_and_its_births(count, level):
    config = replace(choose_preset("paper"), births=BirthSettings(max_births=4096))

    assert make_header(config, 30.0, count).level == level
