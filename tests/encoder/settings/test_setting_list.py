from dataclasses import dataclass

import pytest

from quarc_ref.encoder.settings.config import FIXED_SETTINGS
from quarc_ref.encoder.settings.presets import PRESETS, change_setting, list_settings
from quarc_ref.encoder.settings.setting_list import describe_settings


@dataclass(frozen=True, slots=True)
class _SettingsWithoutDescriptions:
    is_enabled: bool = True


@pytest.mark.parametrize("config", PRESETS.values(), ids=PRESETS)
def test_every_setting_is_listed_with_its_meaning(config):
    described = list(describe_settings(config))

    names = [name for name, _ in list_settings(config) if name not in FIXED_SETTINGS]
    assert [setting.name for setting in described] == names
    assert [setting.name for setting in described if not setting.description] == []
    assert [setting.name for setting in described if not setting.values] == []


@pytest.mark.parametrize("config", PRESETS.values(), ids=PRESETS)
def test_the_listed_texts_are_accepted_as_settings(config):
    changed = PRESETS["paper"]
    for setting in describe_settings(config):
        changed = change_setting(changed, setting.name, setting.text)

    assert changed == config


def test_steps_have_the_digits_that_their_32_bits_need():
    texts = {setting.name: setting.text for setting in describe_settings(PRESETS["paper"])}

    assert texts["stream.log_scale_step"] == "0.01"


def test_a_description_stands_beside_its_field():
    descriptions = {
        setting.name: setting.description for setting in describe_settings(PRESETS["main"])
    }

    assert descriptions["target_kb_per_frame"] == (
        "Target for the mean size of the frames that are not keyframes, in units of 1024 bytes; "
        "0: no target."
    )
    assert descriptions["stream.sh_degree"] == "Degree of spherical harmonics: 0 or 1."


def test_a_field_without_a_description_has_an_empty_one():
    (described,) = describe_settings(_SettingsWithoutDescriptions())

    assert (described.text, described.values, described.description) == ("true", "true, false", "")
