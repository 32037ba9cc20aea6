"""Temporary files of a process killed by SIGKILL, and their treatment by the next one."""

import os
import signal
import subprocess
import sys

import pytest

from quarc_ref.files import (
    MARKER_NAME,
    OutputPathError,
    atomic_file,
    growing_folder,
    remove_leftovers,
    write_file,
    written_folder,
)

pytest.importorskip("fcntl")

_BEGIN = """
import os, signal, sys
from pathlib import Path
from quarc_ref.files import atomic_file, growing_folder, written_folder

target = Path(sys.argv[1])

def die(*_):
    os.kill(os.getpid(), signal.SIGKILL)

"""
_IN_A_FILE = """
with atomic_file(target) as file:
    file.write(b"half")
    file.flush()
    die()
"""
_IN_A_FOLDER = """
with written_folder(target) as made:
    made.write("a.ply", b"whole")
    with made.create_subfolder("inner") as inner:
        inner.write("b.ply", b"whole")
        with inner.open("c.ply") as file:
            die()
"""
_BEFORE_THE_MARKER = """
from quarc_ref.files import folders
folders.mark_folder = die
with written_folder(target) as made:
    pass
"""
_IN_A_GROWING_FOLDER = """
with growing_folder(target) as made:
    made.write("a.ply", b"whole")
    with made.open("b.ply") as file:
        die()
"""
_IN_A_SWAP = """
rename, calls = Path.rename, []
def rename_or_die(*paths):
    calls.append(paths)
    die() if len(calls) == {call} else None
    return rename(*paths)
Path.rename = rename_or_die
with written_folder(target, replace=True) as made:
    made.write("new.ply", b"new")
"""
_KILLED_AFTER_SWAP = """
from quarc_ref.files import folders
folders.remove_output_folder = die
with written_folder(target, replace=True) as made:
    made.write("new.ply", b"new")
"""


def _kill(program, target):
    """Let a process work on a target until it kills itself."""
    completed = subprocess.run([sys.executable, "-c", _BEGIN + program, str(target)], check=False)
    assert completed.returncode == -signal.SIGKILL


def _list(folder):
    return sorted(os.listdir(folder))


def _make_folder(target, *names, **options):
    with written_folder(target, **options) as made:
        for name in names:
            made.write(name, b"old")
    return target


@pytest.mark.parametrize("program", [_IN_A_FILE, _IN_A_FOLDER, _BEFORE_THE_MARKER])
def test_temporary_files_of_a_killed_process_are_removed(program, tmp_path):
    target = tmp_path / "out"
    _kill(program, target)
    remaining_names = _list(tmp_path)
    remove_leftovers(target)

    assert len(remaining_names) == 1
    assert remaining_names[0].startswith(".out.")
    assert _list(tmp_path) == []


def test_the_next_folder_is_created_and_nothing_else_is_left(tmp_path):
    for _ in range(2):
        _kill(_IN_A_FOLDER, tmp_path / "out")
    _make_folder(tmp_path / "out", "a.ply")

    assert _list(tmp_path) == ["out"]
    assert _list(tmp_path / "out") == [MARKER_NAME, "a.ply"]


def test_a_growing_folder_keeps_complete_files_and_is_replaced_with_all_remains(tmp_path):
    target = tmp_path / "out"
    _kill(_IN_A_GROWING_FOLDER, target)
    remaining_names = _list(target)
    with growing_folder(target, replace=True) as made:
        made.write("c.ply", b"new")

    assert len(remaining_names) == 3
    assert {MARKER_NAME, "a.ply"} < set(remaining_names)
    assert _list(target) == [MARKER_NAME, "c.ply"]


@pytest.mark.parametrize("call", [1, 2])
def test_a_folder_in_the_middle_of_replacement_is_restored(call, tmp_path):
    target = _make_folder(tmp_path / "out", "a.ply", "b.ply")
    _kill(_IN_A_SWAP.format(call=call), target)
    is_moved = not target.exists()
    with pytest.raises(OutputPathError, match="out exists"):
        _make_folder(target, "c.ply")

    assert is_moved == (call == 2)
    assert _list(tmp_path) == ["out"]
    assert _list(target) == [MARKER_NAME, "a.ply", "b.ply"]


def test_a_replaced_folder_is_removed(tmp_path):
    target = _make_folder(tmp_path / "out", "a.ply")
    _kill(_KILLED_AFTER_SWAP, target)
    remaining_names = _list(tmp_path)
    remove_leftovers(target)

    assert len(remaining_names) == 2
    assert _list(tmp_path) == ["out"]
    assert _list(target) == [MARKER_NAME, "new.ply"]


def test_foreign_files_in_leftovers_are_kept(tmp_path):
    _kill(_IN_A_FOLDER, tmp_path / "out")
    part = next(tmp_path.iterdir())
    (part / "mine.txt").write_text("mine")
    remove_leftovers(tmp_path / "out")

    assert (part / "mine.txt").read_text() == "mine"


def test_files_of_a_running_process_are_not_removed(tmp_path):
    with written_folder(tmp_path / "out") as made, atomic_file(tmp_path / "out.bin") as file:
        for name in ("out", "out.bin"):
            remove_leftovers(tmp_path / name)
        made.write("a.ply", b"whole")
        file.write(b"whole")

    assert _list(tmp_path) == ["out", "out.bin"]


_RANDOM_PART = "0123456789abcdef"


@pytest.mark.parametrize(
    "name",
    [
        f"out.{_RANDOM_PART}.part",
        f".other.{_RANDOM_PART}.part",
        f".out.{_RANDOM_PART}.parts",
        f".out.{_RANDOM_PART}0.part",
        ".out.123.part",
        f".out.{_RANDOM_PART.upper()}.part",
        f".oxt.{_RANDOM_PART}.part",
    ],
)
def test_similar_names_are_not_removed(name, tmp_path):
    (tmp_path / name).write_text("mine")
    (tmp_path / f"{name}.d").mkdir()
    write_file(tmp_path / "o.t", b"")
    for target in ("out", "o.t"):
        remove_leftovers(tmp_path / target)

    assert _list(tmp_path) == sorted([name, f"{name}.d", "o.t"])


@pytest.mark.parametrize("suffix", ["part", "old"])
def test_a_link_under_such_a_name_is_not_removed(suffix, tmp_path):
    victim = _make_folder(tmp_path / "victim", "a.ply")
    link = tmp_path / f".out.{_RANDOM_PART}.{suffix}"
    link.symlink_to(victim)
    _make_folder(tmp_path / "out", "b.ply")

    assert _list(victim) == [MARKER_NAME, "a.ply"]
    assert link.is_symlink()
    assert _list(tmp_path / "out") == [MARKER_NAME, "b.ply"]


def test_a_folder_under_such_a_name_without_a_marker_is_not_removed(tmp_path):
    folder = tmp_path / f".out.{_RANDOM_PART}.old"
    folder.mkdir()
    (folder / "mine.txt").write_text("mine")
    _make_folder(tmp_path / "out", "b.ply")

    assert _list(folder) == ["mine.txt"]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs root")
def test_leftovers_of_another_user_are_not_removed(tmp_path):
    _kill(_IN_A_FILE, tmp_path / "out")
    os.chown(next(tmp_path.iterdir()), 65534, 65534)
    remove_leftovers(tmp_path / "out")

    assert len(_list(tmp_path)) == 1
