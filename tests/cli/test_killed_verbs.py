"""Tests of verbs that are killed by SIGKILL while they write, and then run again."""

import signal

import pytest

from tests.cli.commands import list_names, make_folder, run
from tests.cli.processes import start

_KILLING_PROGRAM = """
import os, signal, sys
from quarc_ref.__main__ import main
from quarc_ref.files import {owner}

write, calls = {owner}.{method}, []

def write_or_die(*arguments, **named):
    calls.append(arguments)
    if len(calls) == {calls}:
        os.kill(os.getpid(), signal.SIGKILL)
    return write(*arguments, **named)

{owner}.{method} = write_or_die
main()
"""
_KILL_AT_SECOND_FILE = _KILLING_PROGRAM.format(owner="OutputFolder", method="register", calls=2)
_KILL_AT_THIRD_FILE = _KILLING_PROGRAM.format(
    owner="OutputFolder", method="register", calls=3
)  # and sequence.json


def _kill(program, *command):
    with start(*command, program=program) as process:
        process.wait(timeout=120)
    assert process.returncode == -signal.SIGKILL


@pytest.mark.parametrize("options", [[], ["--force"]])
@pytest.mark.parametrize("verb", ["decode", "render"])
def test_a_partly_written_folder_is_removed_by_the_next_run(verb, options, stream_file, tmp_path):
    pytest.importorskip("fcntl")
    folder = tmp_path / "made" / "out"
    folder.parent.mkdir()
    name = "frame_0007.ply" if verb == "decode" else "frame_0007.png"
    if options:
        make_folder(folder, name)
    command = [verb, stream_file, "-o", folder, "--frames", ":2", *options]
    _kill(_KILL_AT_SECOND_FILE, *command)
    remaining_names, old_names = list_names(folder.parent), list_names(folder) if options else None
    result = run(*command)

    assert len(remaining_names) == 1 + bool(options)
    assert remaining_names[0].startswith(".out.")
    assert old_names == ([name] if options else None)
    assert result.exit_code == 0, result.stderr
    assert list_names(folder.parent) == ["out"]
    assert len(list_names(folder)) == 2


def test_frames_of_a_growing_folder_stay_and_are_replaced_by_force(stream_file, tmp_path):
    folder = tmp_path / "out"
    command = ["decode", stream_file, "-o", folder, "--follow"]
    _kill(_KILL_AT_THIRD_FILE, *command)
    remaining_names = list_names(folder)
    rejected_run, forced_run = run(*command), run(*command, "--force")

    assert remaining_names == ["frame_0000.ply"]
    assert (rejected_run.exit_code, forced_run.exit_code) == (2, 0)
    assert "out exists: use --force to replace it" in rejected_run.stderr
    assert len(list_names(folder)) == 4
