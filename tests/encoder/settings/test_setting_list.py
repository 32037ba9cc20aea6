from dataclasses import dataclass

import pytest

from quarc_ref.encoder.settings.presets import PRESETS, change_setting, list_settings
from quarc_ref.encoder.settings.setting_list import explain_settings


@dataclass(frozen=True, slots=True)
class _Bare:
    on: bool = True


@pytest.mark.parametrize("config", PRESETS.values(), ids=PRESETS)
def test_every_setting_is_there_with_its_meaning(config):
    explained = list(explain_settings(config))

    assert [each.name for each in explained] == list(dict(list_settings(config)))
    assert [each.name for each in explained if not each.meaning] == []
    assert [each.name for each in explained if not each.takes] == []


@pytest.mark.parametrize("config", PRESETS.values(), ids=PRESETS)
def test_the_texts_are_those_that_settings_are_changed_by(config):
    changed = PRESETS["paper"]
    for each in explain_settings(config):
        changed = change_setting(changed, each.name, each.text)

    assert changed == config


def test_a_meaning_of_several_lines_is_one():
    meanings = {each.name: each.meaning for each in explain_settings(PRESETS["main"])}

    assert meanings["target_kb_per_frame"] == (
        "KB (1024 bytes) that a frame after the canonical one is to have in the mean; "
        "0 for no target."
    )


def test_without_a_docstring_there_is_no_meaning():
    (explained,) = explain_settings(_Bare())

    assert (explained.text, explained.takes, explained.meaning) == ("true", "true, false", "")
