"""Every verb under every kind of stress: a message, the right exit code, nothing incomplete."""

import os
import signal
import sys
import tempfile
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import pytest

from quarc_ref.cli.app import app
from quarc_ref.cli.errors import install_sigterm_handler
from tests.cli.commands import list_names, make_folder, run
from tests.cli.stress import (
    INPUTS_BY_VERB,
    OUTPUT_VERBS,
    VERBS,
    drop_privileges,
    fill_up,
    mount_small_disk,
    readonly_folder,
)


@pytest.fixture
def place(stream_file, encoded_stream, capture, recordings, tmp_path):
    """Inputs of the verbs, and an empty folder for output."""
    made = tmp_path / "made"
    made.mkdir()
    reads = {"stream": stream_file, "encoded": encoded_stream.file, "capture": capture}
    reads["recordings"] = recordings
    return SimpleNamespace(reads=reads, made=made, beside=tmp_path)


def _run(name, place, *options, out=None, **others):
    """Run a verb; `others` replace its inputs."""
    verb = VERBS[name]
    pytest.importorskip(verb.needs)
    places = {**place.reads, "out": out or place.made / "out", **others}
    return run(name, *verb.fill(places), *options)


def _said(result, code):
    """The error messages of a verb that ended as expected."""
    assert result.exit_code == code, result.stderr
    assert result.stderr.strip()
    return " ".join(result.stderr.replace("│", " ").split())


def test_every_verb_has_a_row():
    assert set(VERBS) == {command.name for command in app.registered_commands}


@pytest.mark.parametrize(("name", "what"), INPUTS_BY_VERB)
def test_a_missing_input_cannot_be_read(name, what, place, monkeypatch):
    monkeypatch.chdir(place.beside)
    result = _run(name, place, **{what: "no_such_thing"})

    assert ": 'no_such_thing' does not exist." in _said(result, 2)
    assert list_names(place.made) == []


@pytest.mark.parametrize(("name", "what"), INPUTS_BY_VERB)
def test_a_folder_is_not_a_stream_and_a_file_not_a_capture(name, what, place, monkeypatch):
    if name == "compare" and what != "capture":
        pytest.skip("compares folders too")
    monkeypatch.chdir(place.beside)
    damaged_data, error = ("small.quarc", "not a") if what == "capture" else ("made", "a")
    result = _run(name, place, **{what: damaged_data})

    assert f": '{damaged_data}' is {error} folder." in _said(result, 2)
    assert list_names(place.made) == []


@pytest.mark.parametrize(("name", "what"), INPUTS_BY_VERB)
def test_an_input_of_another_kind_is_reported(name, what, place):
    other = place.beside / "other"
    other.mkdir() if what == "capture" else other.write_bytes(b"no stream at all")
    result = _run(name, place, **{what: other})

    _said(result, 3 if what == "capture" and name != "doctor" else 1)  # which rejects it
    assert not (place.made / "out").exists()


@pytest.mark.parametrize(("name", "what"), INPUTS_BY_VERB)
def test_an_unreadable_input_is_reported(name, what, place):
    if name in ("compare", "doctor", "encode", "eval", "publish", "render"):
        pytest.skip("needs compiled code, whose cache the other user cannot read")
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        secret = Path(folder) / "secret.quarc"
        secret.write_bytes(place.reads[what].read_bytes())
        secret.chmod(0)
        with drop_privileges():
            result = _run(name, place, out=Path(folder) / "out", **{what: secret})

    assert "ermission denied" in _said(result, 3)


@pytest.mark.parametrize("name", OUTPUT_VERBS)
def test_nothing_is_written_into_a_missing_folder(name, place):
    result = _run(name, place, out=place.made / "no" / "out")

    assert "is not a folder" in _said(result, 2)
    assert list_names(place.made) == []


@pytest.mark.parametrize("name", [name for name in OUTPUT_VERBS if VERBS[name].makes == "folder"])
def test_a_folder_cannot_go_to_standard_output(name, place, monkeypatch):
    monkeypatch.chdir(place.made)
    result = _run(name, place, out="-")

    message = "quarc-ref: -: a folder cannot be written to standard output: give a path"
    assert _said(result, 2) == message
    assert list_names(place.made) == []


@pytest.mark.parametrize("name", OUTPUT_VERBS)
def test_existing_output_is_not_replaced_without_force(name, place):
    old = _make_old_target(name, place.made)
    result = _run(name, place)

    _said(result, 2)
    assert old.read_text() == "old"
    assert list_names(place.made) == ["out"]


def _make_old_target(name, folder):
    """Make a target as if from an earlier run; return one of its files."""
    out = folder / "out"
    if VERBS[name].makes == "file":
        out.write_text("old")
        return out
    names = {
        "demo": "demo.quarc",
        "eval": "index.html",
        "publish": "index.html",
        "render": "frame_0000.png",
        "synth": "cam00.mp4",
    }
    old = names.get(name, "frame_0000.ply")
    return make_folder(out, old) / old


@pytest.mark.parametrize("name", OUTPUT_VERBS)
def test_a_file_does_not_replace_a_folder_nor_the_reverse(name, place):
    out = place.made / "out"
    out.mkdir() if VERBS[name].makes == "file" else out.write_text("old")
    result = _run(name, place, "--force")

    _said(result, 2)
    assert list_names(place.made) == ["out"]


@pytest.mark.parametrize("name", OUTPUT_VERBS)
def test_in_a_readonly_folder_nothing_is_written(name, place):
    with readonly_folder(place.made):
        result = _run(name, place)

        assert "ermission denied" in (said := _said(result, 3)) or "Read-only" in said
        assert list_names(place.made) == []


@pytest.mark.parametrize("name", OUTPUT_VERBS)
def test_a_full_disk_leaves_existing_files_unchanged(name, place):
    with mount_small_disk(place.made, "size=64k"):
        old = _make_old_target(name, place.made)
        contents_before = [*list_names(place.made), "filler"]
        fill_up(place.made)
        result = _run(name, place, "--force")

        assert "No space left on device" in _said(result, 3)
        assert list_names(place.made) == sorted(contents_before)
        assert old.read_text() == "old"


@pytest.fixture
def _handle_signals_like_the_command():
    contents_before = {item: signal.getsignal(item) for item in (signal.SIGTERM, signal.SIGINT)}
    install_sigterm_handler()
    yield
    for item, handler in contents_before.items():
        signal.signal(item, handler)


@pytest.mark.usefixtures("_handle_signals_like_the_command")
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("name", VERBS)
def test_an_interruption_leaves_nothing_incomplete(name, ending, place, monkeypatch):
    verb = VERBS[name]
    pytest.importorskip(verb.needs)
    reached = _send_signal_in(verb.middle, ending, monkeypatch)
    old = _make_old_target(name, place.made) if verb.makes else None
    result = _run(name, place, *["--force"] * (old is not None))

    assert reached
    assert result.exit_code == 128 + ending, result.stderr
    assert "interrupted" in result.stderr
    assert {*list_names(place.made)} <= {*(["out"] if old else []), *verb.leaves}
    assert old is None or old.read_text() == "old"


def _send_signal_in(dotted_name, ending, monkeypatch):
    """Send a signal at the second call of a function; return the list of calls."""
    owner, attribute = _find(dotted_name)
    original, reached = getattr(owner, attribute), []

    def call(*arguments, **listed_names):
        result = original(*arguments, **listed_names)
        reached.append(attribute)
        if len(reached) == 2:
            signal.raise_signal(ending)
        return result

    monkeypatch.setattr(owner, attribute, call)
    return reached


def _find(dotted_name):
    """The module or class that contains a dotted name, and the last part of the name."""
    path, _, attribute = dotted_name.rpartition(".")
    try:
        return import_module(path), attribute
    except ImportError:
        module, _, kind = path.rpartition(".")
        return getattr(import_module(module), kind), attribute


@pytest.mark.parametrize("name", VERBS)
def test_a_closed_standard_output_is_not_a_fault_of_the_stream(name, place, monkeypatch, capfd):
    reading, writing = os.pipe()
    os.close(reading)
    words = [name, *VERBS[name].fill({**place.reads, "out": place.made / "out"})]
    with os.fdopen(writing, "w") as pipe, monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", pipe)
        with pytest.raises(SystemExit) as remaining_names:
            app([*map(str, words), "--json"])

    assert remaining_names.value.code == 128 + signal.SIGPIPE
    said = capfd.readouterr().err.splitlines()
    assert [line for line in said if "quarc-ref:" in line and ": warning: " not in line] == []
