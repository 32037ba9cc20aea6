import json
import subprocess
import sys

import pytest
import typer.main

from quarc_ref import __version__
from quarc_ref.cli.app import app
from quarc_ref.format.constants import VERSION_MAJOR, VERSION_MINOR
from tests.cli.commands import run

VERBS = [
    *("encode", "decode", "verify", "info", "inspect", "cut", "join"),
    *("view", "publish", "render", "eval", "synth", "demo"),
]
HEAVY_PACKAGES = {"torch", "cv2", "matplotlib", "scipy", "numba", "av", "pycolmap", "gsplat"}

_LIST_MODULES = """
import json, sys
from quarc_ref.__main__ import main
sys.argv = ["quarc-ref", *sys.argv[1:]]
try:
    main()
finally:
    sys.stderr.write(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})))
"""


def _list_loaded_modules(*arguments):
    """Return the top-level modules that a command line loads in a separate process."""
    program = [sys.executable, "-c", _LIST_MODULES, *map(str, arguments)]
    completed = subprocess.run(program, capture_output=True, text=True, check=True)
    return set(json.loads(completed.stderr.splitlines()[-1]))


def test_help_names_every_verb():
    result = run("--help")

    assert result.exit_code == 0
    assert all(f" {verb} " in result.stdout for verb in VERBS)


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_help_and_json(verb):
    result = run(verb, "-h")

    assert result.exit_code == 0
    assert "--json" in result.stdout


@pytest.mark.parametrize("verb", typer.main.get_command(app).commands)
def test_help_shows_every_option_in_full_at_80_columns(verb, monkeypatch):
    monkeypatch.setattr("typer.rich_utils.MAX_WIDTH", 80)
    result = run(verb, "--help")

    assert result.exit_code == 0
    assert "\u2026" not in result.stdout


def test_the_versions_of_package_and_format_are_printed():
    result = run("--version")

    assert result.stdout.strip() == (
        f"quarc-ref {__version__}, format {VERSION_MAJOR}.{VERSION_MINOR}"
    )


@pytest.mark.parametrize("arguments", [["nonsense"], ["info", "--nonsense"], ["info"]])
def test_an_invalid_command_line_is_a_usage_error(arguments):
    assert run(*arguments).exit_code == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--to", "foo"], "'foo' is not one of 'mp4', 'webm', 'png', 'npz'."),
        (["--width", "0"], "greater than or equal to 1"),
    ],
)
def test_an_invalid_value_of_an_option_is_rejected_in_plain_words(arguments, message, stream_file):
    result = run("render", stream_file, "-o", "out", *arguments)

    messages = " ".join(result.stderr.replace("\u2502", " ").split())
    assert result.exit_code == 2
    assert f"Invalid value for '{arguments[0]}'" in messages
    assert message in messages
    assert "Value error" not in messages


def test_help_loads_no_slow_modules():
    assert not _list_loaded_modules("--help") & (
        HEAVY_PACKAGES | {"numpy", "construct", "constriction"}
    )
    assert not _list_loaded_modules("encode", "--help") & (
        HEAVY_PACKAGES | {"numpy", "construct", "constriction"}
    )


@pytest.mark.parametrize("verb", ["info", "verify", "inspect"])
def test_verbs_that_need_only_a_stream_load_no_image_libraries(verb, stream_file):
    assert not _list_loaded_modules(verb, stream_file, "--json") & HEAVY_PACKAGES


def test_decoding_loads_no_image_libraries(stream_file, tmp_path):
    assert (
        not _list_loaded_modules("decode", stream_file, "-o", tmp_path / "out", "--json")
        & HEAVY_PACKAGES
    )
