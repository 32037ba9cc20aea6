"""A verb that is killed by SIGKILL in the middle, and run again."""

import signal

import pytest

from tests.cli.commands import list_names, make_folder, run
from tests.cli.processes import start

_KILLING_PROGRAM = """
import os, signal, sys
from quarc_ref.cli.app import main
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
_IN_A_FOLDER = _KILLING_PROGRAM.format(owner="OutputFolder", method="add", calls=2)
_AFTER_A_FRAME = _KILLING_PROGRAM.format(
    owner="OutputFolder", method="add", calls=3
)  # and sequence.json


def _kill(program, *command):
    with start(*command, program=program) as verb:
        verb.wait(timeout=120)
    assert verb.returncode == -signal.SIGKILL


@pytest.mark.parametrize("options", [[], ["--force"]])
@pytest.mark.parametrize("verb", ["decode", "render"])
def test_a_partly_written_folder_is_removed_by_the_next_run(verb, options, stream_file, tmp_path):
    pytest.importorskip("fcntl")
    out = tmp_path / "made" / "out"
    out.parent.mkdir()
    name = "frame_0007.ply" if verb == "decode" else "frame_0007.png"
    if options:
        make_folder(out, name)
    command = [verb, stream_file, "-o", out, "--frames", ":2", *options]
    _kill(_IN_A_FOLDER, *command)
    remaining_names, kept_contents = list_names(out.parent), list_names(out) if options else None
    result = run(*command)

    assert len(remaining_names) == 1 + bool(options)
    assert remaining_names[0].startswith(".out.")
    assert kept_contents == ([name] if options else None)
    assert result.exit_code == 0, result.stderr
    assert list_names(out.parent) == ["out"]
    assert len(list_names(out)) == 2


def test_frames_of_a_growing_folder_stay_and_are_replaced_by_force(stream_file, tmp_path):
    out = tmp_path / "out"
    command = ["decode", stream_file, "-o", out, "--follow"]
    _kill(_AFTER_A_FRAME, *command)
    remaining_names = list_names(out)
    rejected_run, forced_run = run(*command), run(*command, "--force")

    assert remaining_names == ["frame_0000.ply"]
    assert (rejected_run.exit_code, forced_run.exit_code) == (2, 0)
    assert "out exists: use --force to replace it" in rejected_run.stderr
    assert len(list_names(out)) == 4
