"""Tests of shell completion."""

import os
import subprocess

import pytest

from quarc_ref.encoder.settings.presets import PRESETS, choose_preset
from quarc_ref.encoder.settings.setting_list import describe_settings
from quarc_ref.export.table import EXPORT_FORMATS
from tests.cli.processes import COMMAND


def _run_with_environment(*arguments, **environment):
    """Run the command with environment variables, and return its standard output."""
    command, variables = [*COMMAND, *arguments], os.environ | environment
    completed = subprocess.run(command, env=variables, capture_output=True, text=True, check=True)
    assert completed.stderr == ""
    return completed.stdout


def _complete(line):
    """Return the bash completions for the last word of a line, which may be empty."""
    word_index = str(len(line.split(" ")) - 1)
    return _run_with_environment(
        COMP_WORDS=line, COMP_CWORD=word_index, _QUARC_REF_COMPLETE="complete_bash"
    ).split()


@pytest.mark.parametrize(
    ("line", "completions"),
    [
        ("quarc-ref enc", ["encode"]),
        ("quarc-ref decode --rec", ["--recover"]),
        ("quarc-ref decode a.quarc --to ", list(EXPORT_FORMATS)),
        ("quarc-ref encode cap --preset ", list(PRESETS)),
        ("quarc-ref encode cap --set motion.lr", ["motion.lr=", "motion.lr_end_factor="]),
        ("quarc-ref demo --set canonical.ke", ["canonical.keyframe_interval="]),
        ("quarc-ref info ", []),  # bash completes file names in this case
    ],
)
def test_verbs_options_presets_and_settings_are_completed(line, completions):
    assert _complete(line) == completions


def test_every_setting_is_completed():
    names = [f"{setting.name}=" for setting in describe_settings(choose_preset("main"))]

    assert _complete("quarc-ref encode cap --set ") == names


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_completion_script_calls_the_command(shell):
    script = _run_with_environment(
        "--show-completion", shell, _TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1"
    )

    assert f"_QUARC_REF_COMPLETE=complete_{shell}" in script


def test_zsh_shows_the_description_of_a_setting():
    line = "quarc-ref encode cap --set canonical.lambda"
    completions = _run_with_environment(
        _TYPER_COMPLETE_ARGS=line, _QUARC_REF_COMPLETE="complete_zsh"
    )

    assert '"canonical.lambda_dssim=":"Weight w of D-SSIM in the loss' in completions
