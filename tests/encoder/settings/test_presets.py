from dataclasses import asdict, replace

import numpy as np
import pytest

from quarc_ref.encoder import EncodeOptions
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.config import EncoderConfig, StepSettings, make_header
from quarc_ref.encoder.settings.frames import BirthSettings
from quarc_ref.encoder.settings.presets import (
    PRESETS,
    SettingError,
    change_setting,
    change_settings,
    choose_preset,
    list_settings,
)
from quarc_ref.encoder.settings.renamed import RENAMED


def test_paper_has_the_settings_of_the_paper():
    paper = choose_preset("paper")

    assert paper.canonical == CanonicalSettings(iterations=15_000, quantize_from=1.0)
    assert (paper.canonical.position_noise, paper.canonical.lambda_dssim) == (0.01, 0.2)
    assert (paper.motion.iterations, paper.motion.lr, paper.motion.momentum) == (100, 5e-4, 0.6)
    assert (paper.motion.rate_model, paper.motion.rd_lambda) == ("l1", 1.0)
    assert paper.births == BirthSettings(iterations=100)
    assert (paper.stream.gaussians_per_anchor, paper.stream.anchor_ratio) == (4, 3)
    assert (paper.stream.rotation_components, paper.stream.resample_interval) == (4, 2)
    assert paper.steps == StepSettings()


@pytest.mark.parametrize("name", ["log_scale_step", "opacity_step", "sh_dc_step", "sh_rest_step"])
def test_the_papers_attribute_steps_are_a_hundredth_to_float_precision(name):
    assert getattr(choose_preset("paper").stream, name) == pytest.approx(0.01, rel=1e-7)


def test_the_main_preset_is_the_default():
    assert EncodeOptions().config == choose_preset("main")


@pytest.mark.parametrize(
    ("path", "text", "value"),
    [
        ("motion.lr", "5e-3", 5e-3),
        ("canonical.iterations", "7", 7),
        ("births.split_iters", "10,20,30", (10, 20, 30)),
        ("births.split_iters", "", ()),
        ("births.rd_selection", "no", False),
        ("motion.rate_model", "l1", "l1"),
        ("stream.translation_step", "3", 3),
        ("stream.sh_dc_step", "0.05", float(np.float32(0.05))),
        ("stream.meters_per_unit", "0.3", float(np.float32(0.3))),
        ("seed", "12", 12),
    ],
)
def test_a_setting_can_be_changed_by_its_name(path, text, value):
    changed = change_setting(choose_preset("main"), path, text)

    assert dict(list_settings(changed))[path] == value


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("canonical.iterations", "0"),
        ("canonical.densification_interval", "0"),
        ("canonical.position_lr_final", "0"),
        ("motion.iterations", "-1"),
        ("motion.lr", "nan"),
        ("motion.lr", "inf"),
        ("births.max_births", "-1"),
        ("births.death_opacity", "1.1"),
        ("updates.choose_at", "0"),
        ("stream.gaussians_per_anchor", "0"),
        ("stream.log_scale_step", "nan"),
        ("seed", str(1 << 64)),
    ],
)
def test_a_value_out_of_range_is_rejected_by_name(path, text):
    with pytest.raises(SettingError, match=f"^{path}={text}: {path.split('.')[-1]} "):
        change_setting(choose_preset("main"), path, text)


def test_changing_a_setting_leaves_all_others():
    original = dict(list_settings(choose_preset("main")))
    changed = dict(list_settings(change_setting(choose_preset("main"), "motion.lr", "0.5")))

    assert {name for name in original if original[name] != changed[name]} == {"motion.lr"}


@pytest.mark.parametrize(
    ("path", "text", "message"),
    [
        ("motion.lrr", "1", "motion.lr"),
        ("lr", "1", "similar names: motion.lr, updates.lr; "),
        ("motion", "1", "no setting"),
        ("", "1", "no setting"),
        ("motion.iterations", "many", "motion.iterations takes"),
        ("births.rd_selection", "perhaps", "true, false"),
        ("motion.rate_model", "l2", "l1, group_log"),
        ("births.split_iters", "a,b", "births.split_iters"),
        ("stream.level_count", "9", "level_count"),
        ("canonical.max_gaussians", "1048577", "an integer from 1 to 1048576"),
        ("births.max_births", "65537", "an integer from 0 to 65536"),
        ("stream.seed", "7", "stream.seed cannot be set: the setting seed determines it"),
        ("stream.timescale", "25", "the frame rate of the capture determines it"),
        ("stream.snapshots", "true", "canonical.snapshot_interval determines it"),
    ],
)
def test_an_unknown_setting_is_rejected(path, text, message):
    with pytest.raises(SettingError, match=message):
        change_setting(choose_preset("main"), path, text)


@pytest.mark.parametrize("name", ["position_step", "translation_step"])
def test_a_step_that_another_setting_replaces_is_rejected(name):
    main, change = choose_preset("main"), (f"stream.{name}", "64")
    no_steps = [(f"steps.{step}", "0") for step in asdict(main.steps)]

    with pytest.raises(SettingError, match=rf"stream\.{name} has no effect, because steps\."):
        change_settings(main, [change])
    assert getattr(change_settings(main, [change, *no_steps]).stream, name) == 64
    assert getattr(change_settings(choose_preset("demo"), [change]).stream, name) == 64


@pytest.mark.parametrize(
    ("path", "text", "takes"),
    [
        ("canonical.iterations", "1.5", "an integer of at least 1"),
        ("motion.lr", "abc", "a number of at least 0"),
        ("motion.lambda_dssim", "", "a number from 0 to 1"),
        ("rd_lambda", "much", "a number above 0"),
        ("updates.choose_at", "x", "a number above 0 and at most 1"),
        ("stream.level_count", "1.5", "an integer"),
        ("stream.opacity_step", "x", "a number"),
        ("births.rd_selection", "perhaps", "true, false"),
        ("births.split_iters", "1,b", "integers separated by commas"),
        ("births.placement", "here", "gate, errors"),
    ],
)
def test_an_unparsable_value_is_rejected_with_the_type_of_the_setting(path, text, takes):
    with pytest.raises(SettingError) as caught:
        change_setting(choose_preset("main"), path, text)

    assert str(caught.value) == f"{path} takes {takes}, not {text!r}"


def test_an_unknown_preset_is_rejected_with_the_known_ones():
    with pytest.raises(SettingError, match="paper"):
        choose_preset("best")


@pytest.mark.parametrize("config", PRESETS.values(), ids=PRESETS)
def test_every_preset_gives_a_valid_header(config: EncoderConfig):
    header = make_header(config, 29.97, 40_000)

    assert header.frames_per_second == pytest.approx(29.97, rel=1e-5)
    assert header.level == 10


@pytest.mark.parametrize(
    ("count", "level"), [(61_000, 10), (62_000, 20), (1 << 18, 30), (1 << 20, 31)]
)
def test_the_level_allows_the_scene_and_its_births(count, level):
    config = replace(choose_preset("paper"), births=BirthSettings(max_births=4096))

    assert make_header(config, 30.0, count).level == level


@pytest.mark.parametrize(("max_births", "level"), [(4096, 10), (4097, 20), (1 << 16, 30)])
def test_the_level_allows_the_births_of_a_frame(max_births, level):
    config = replace(choose_preset("paper"), births=BirthSettings(max_births=max_births))

    assert make_header(config, 30.0, 9).level == level


@pytest.mark.parametrize(("old", "new"), RENAMED.items(), ids=RENAMED)
def test_an_old_name_is_rejected_with_the_new_one(old, new):
    with pytest.raises(SettingError, match=f"^setting '{old}' is now '{new}'$"):
        change_setting(choose_preset("main"), old, "1")

    assert new in dict(list_settings(choose_preset("main")))
    assert old not in dict(list_settings(choose_preset("main")))
