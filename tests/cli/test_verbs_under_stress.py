"""Tests that every verb reports faults with the right exit code and leaves nothing incomplete."""

import os
import re
import signal
import sys
import tempfile
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import pytest

from quarc_ref.cli.app import app
from quarc_ref.cli.signals import exit_on_signals
from tests.cli.commands import list_names, make_folder, run
from tests.cli.stress import (
    INPUTS_BY_VERB,
    OUTPUT_VERBS,
    VERBS,
    drop_privileges,
    fill_disk,
    mount_small_disk,
    readonly_folder,
)
from tests.marks import thorough


@pytest.fixture
def workspace(stream_file, encoded_stream, capture, recordings, tmp_path):
    """Paths of the verbs' inputs, an empty folder for output, and the parent of that folder."""
    output_folder = tmp_path / "made"
    output_folder.mkdir()
    inputs = {"stream": stream_file, "encoded": encoded_stream.file, "capture": capture}
    inputs["recordings"] = recordings
    return SimpleNamespace(inputs=inputs, output_folder=output_folder, parent=tmp_path)


def _run(name, workspace, *options, output_path=None, **replaced_inputs):
    """Run a verb; skips the test if the verb requires a package that is not installed."""
    verb = VERBS[name]
    pytest.importorskip(verb.required_package)
    paths = {
        **workspace.inputs,
        "out": output_path or workspace.output_folder / "out",
        **replaced_inputs,
    }
    return run(name, *verb.fill_arguments(paths), *options)


def _get_messages(result, code):
    """Check the exit code of a verb, and return its error messages in a line."""
    assert result.exit_code == code, result.stderr
    assert result.stderr.strip()
    return " ".join(result.stderr.replace("│", " ").split())


def test_every_verb_has_a_row():
    assert set(VERBS) == {command.name for command in app.registered_commands}


@pytest.mark.parametrize(("name", "input_name"), INPUTS_BY_VERB)
def test_a_missing_input_cannot_be_read(name, input_name, workspace, monkeypatch):
    monkeypatch.chdir(workspace.parent)
    result = _run(name, workspace, **{input_name: "no_such_thing"})

    assert ": 'no_such_thing' does not exist." in _get_messages(result, 2)
    assert list_names(workspace.output_folder) == []


@pytest.mark.parametrize(("name", "input_name"), INPUTS_BY_VERB)
def test_a_folder_is_not_a_stream_and_a_file_not_a_capture(
    name, input_name, workspace, monkeypatch
):
    if name == "compare" and input_name != "capture":
        pytest.skip("compares folders too")
    monkeypatch.chdir(workspace.parent)
    wrong_input, error = ("small.quarc", "not a") if input_name == "capture" else ("made", "a")
    result = _run(name, workspace, **{input_name: wrong_input})

    assert f": '{wrong_input}' is {error} folder." in _get_messages(result, 2)
    assert list_names(workspace.output_folder) == []


@pytest.mark.parametrize(("name", "input_name"), INPUTS_BY_VERB)
def test_an_input_of_another_kind_is_reported(name, input_name, workspace):
    wrong_input = workspace.parent / "other"
    wrong_input.mkdir() if input_name == "capture" else wrong_input.write_bytes(b"no stream at all")
    result = _run(name, workspace, **{input_name: wrong_input})

    _get_messages(
        result, 3 if input_name == "capture" and name != "doctor" else 1
    )  # which rejects it
    assert not (workspace.output_folder / "out").exists()


@pytest.mark.parametrize(("name", "input_name"), INPUTS_BY_VERB)
def test_an_unreadable_input_is_reported(name, input_name, workspace):
    if name in ("compare", "doctor", "encode", "eval", "publish", "render"):
        pytest.skip("needs compiled code, whose cache the other user cannot read")
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        unreadable_file = Path(folder) / "secret.quarc"
        unreadable_file.write_bytes(workspace.inputs[input_name].read_bytes())
        unreadable_file.chmod(0)
        with drop_privileges():
            result = _run(
                name, workspace, output_path=Path(folder) / "out", **{input_name: unreadable_file}
            )

    assert "ermission denied" in _get_messages(result, 3)


@pytest.mark.parametrize("name", OUTPUT_VERBS)
def test_nothing_is_written_into_a_missing_folder(name, workspace):
    result = _run(name, workspace, output_path=workspace.output_folder / "no" / "out")

    assert "is not a folder" in _get_messages(result, 2)
    assert list_names(workspace.output_folder) == []


@pytest.mark.parametrize(
    "name", [name for name in OUTPUT_VERBS if VERBS[name].output_kind == "folder"]
)
def test_a_folder_cannot_go_to_standard_output(name, workspace, monkeypatch):
    monkeypatch.chdir(workspace.output_folder)
    result = _run(name, workspace, output_path="-")

    message = "quarc-ref: a folder cannot be written to standard output (-): give a path"
    assert _get_messages(result, 2) == message
    assert list_names(workspace.output_folder) == []


@pytest.mark.parametrize("name", OUTPUT_VERBS)
def test_existing_output_is_not_replaced_without_force(name, workspace):
    old_file = _make_old_target(name, workspace.output_folder)
    result = _run(name, workspace)

    _get_messages(result, 2)
    assert old_file.read_text() == "old"
    assert list_names(workspace.output_folder) == ["out"]


def _make_old_target(name, folder):
    """Make the output of an earlier run, and return a file of it."""
    target = folder / "out"
    if VERBS[name].output_kind == "file":
        target.write_text("old")
        return target
    names_by_verb = {
        "demo": "demo.quarc",
        "eval": "index.html",
        "publish": "index.html",
        "render": "frame_0000.png",
        "synth": "cam00.mp4",
    }
    file_name = names_by_verb.get(name, "frame_0000.ply")
    return make_folder(target, file_name) / file_name


@pytest.mark.parametrize("name", OUTPUT_VERBS)
def test_a_file_does_not_replace_a_folder_nor_the_reverse(name, workspace):
    target = workspace.output_folder / "out"
    target.mkdir() if VERBS[name].output_kind == "file" else target.write_text("old")
    result = _run(name, workspace, "--force")

    _get_messages(result, 2)
    assert list_names(workspace.output_folder) == ["out"]


@pytest.mark.parametrize("name", OUTPUT_VERBS)
def test_in_a_readonly_folder_nothing_is_written(name, workspace):
    with readonly_folder(workspace.output_folder):
        result = _run(name, workspace)

        messages = _get_messages(result, 3)
        assert re.search(
            rf"{workspace.output_folder}/out\S*: (Permission denied|Read-only)", messages
        )
        assert list_names(workspace.output_folder) == []


@pytest.mark.parametrize("name", OUTPUT_VERBS)
def test_a_full_disk_leaves_existing_files_unchanged(name, workspace):
    with mount_small_disk(workspace.output_folder, "size=64k"):
        old_file = _make_old_target(name, workspace.output_folder)
        names_before = [*list_names(workspace.output_folder), "filler"]
        fill_disk(workspace.output_folder)
        result = _run(name, workspace, "--force")

        messages = _get_messages(result, 3)
        assert re.search(rf"{workspace.output_folder}/out\S*: No space left on device", messages)
        assert list_names(workspace.output_folder) == sorted(names_before)
        assert old_file.read_text() == "old"


@pytest.fixture
def _handle_signals_like_the_command():
    handlers_before = {
        number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)
    }
    exit_on_signals()
    yield
    for number, handler in handlers_before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("_handle_signals_like_the_command")
@pytest.mark.parametrize("signal_number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("name", VERBS)
def test_an_interruption_leaves_nothing_incomplete(name, signal_number, workspace, monkeypatch):
    verb = VERBS[name]
    pytest.importorskip(verb.required_package)
    calls = _send_signal_in(verb.interrupted_function, signal_number, monkeypatch)
    old_file = _make_old_target(name, workspace.output_folder) if verb.output_kind else None
    result = _run(name, workspace, *["--force"] * (old_file is not None))

    assert calls
    assert result.exit_code == 128 + signal_number, result.stderr
    assert ("stopped" if name == "view" else "interrupted") in result.stderr
    assert {*list_names(workspace.output_folder)} <= {
        *(["out"] if old_file else []),
        *verb.leftover_names,
    }
    assert old_file is None or old_file.read_text() == "old"


def _send_signal_in(dotted_name, signal_number, monkeypatch):
    """Send a signal at the second call of a function; return a list with an element per call."""
    owner, attribute = _find_owner(dotted_name)
    original, calls = getattr(owner, attribute), []

    def call(*arguments, **keywords):
        result = original(*arguments, **keywords)
        calls.append(attribute)
        if len(calls) == 2:
            signal.raise_signal(signal_number)
        return result

    monkeypatch.setattr(owner, attribute, call)
    return calls


def _find_owner(dotted_name):
    """Return the module or class that contains a dotted name, and the last part of the name."""
    path, _, attribute = dotted_name.rpartition(".")
    try:
        return import_module(path), attribute
    except ImportError:
        module, _, kind = path.rpartition(".")
        return getattr(import_module(module), kind), attribute


@pytest.mark.parametrize(
    "name", [thorough(name) if name in ("calibrate", "demo") else name for name in VERBS]
)
def test_a_closed_standard_output_is_not_a_fault_of_the_stream(name, workspace, monkeypatch, capfd):
    read_end, write_end = os.pipe()
    os.close(read_end)
    command_line = [
        name,
        *VERBS[name].fill_arguments({**workspace.inputs, "out": workspace.output_folder / "out"}),
    ]
    with os.fdopen(write_end, "w") as pipe, monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", pipe)
        with pytest.raises(SystemExit) as exit_info:
            app([*map(str, command_line), "--json"])

    assert exit_info.value.code == 128 + signal.SIGPIPE
    message_lines = capfd.readouterr().err.splitlines()
    assert [
        line for line in message_lines if "quarc-ref:" in line and ": warning: " not in line
    ] == []
