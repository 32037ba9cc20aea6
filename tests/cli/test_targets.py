import os
from pathlib import Path

import pytest

from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.targets import (
    growing_folder,
    open_output_file,
    open_output_frame,
    open_output_stream,
    written_folder,
)
from quarc_ref.files import OutputPathError
from tests.cli.commands import list_names, make_folder

_FOLDER_FUNCTIONS = [written_folder, growing_folder]


def _write_half(target, *, force, error):
    with open_output_file(target, force=force) as sink:
        sink.write(b"half")
        raise error


def _write_frame(open_target, target, *, force=False, error=None):
    with open_target(target, force=force) as folder:
        folder.write("frame_1.ply", b"new")
        if error:
            raise error


@pytest.fixture
def old_folder(tmp_path):
    return make_folder(tmp_path / "out", "frame_0.ply")


def test_a_file_is_invisible_until_complete(tmp_path):
    target = tmp_path / "a.quarc"
    with open_output_file(target, force=False) as sink:
        sink.write(b"half")
        assert not target.exists()
        sink.write(b"whole")

    assert target.read_bytes() == b"halfwhole"
    assert list_names(tmp_path) == ["a.quarc"]


@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()])
@pytest.mark.parametrize("force", [False, True])
def test_an_interrupted_file_leaves_nothing_and_keeps_the_old_one(error, force, tmp_path):
    if force:
        (tmp_path / "a.quarc").write_bytes(b"old")
    with pytest.raises(type(error)):
        _write_half(tmp_path / "a.quarc", force=force, error=error)

    assert [path.read_bytes() for path in tmp_path.iterdir()] == ([b"old"] if force else [])


@pytest.mark.parametrize("open_target", [open_output_file, open_output_frame])
def test_an_existing_file_is_replaced_only_with_force(open_target, tmp_path):
    target = tmp_path / "a.quarc"
    target.write_bytes(b"old")
    with pytest.raises(UsageError, match="--force"), open_target(target, force=False):
        pytest.fail("the target was opened")
    data_after_rejection = target.read_bytes()
    with open_output_file(target, force=True) as sink:
        sink.write(b"new")

    assert data_after_rejection == b"old"
    assert target.read_bytes() == b"new"


@pytest.mark.parametrize("open_target", [open_output_file, open_output_frame, open_output_stream])
@pytest.mark.parametrize("force", [False, True])
def test_a_file_does_not_replace_a_folder(force, open_target, old_folder):
    with pytest.raises(UsageError, match="is a folder"), open_target(old_folder, force=force):
        pytest.fail("the target was opened")

    assert list_names(old_folder) == ["frame_0.ply"]


@pytest.mark.skipif(os.name == "nt", reason="no named pipes")
@pytest.mark.parametrize("open_target", [open_output_file, open_output_frame, open_output_stream])
@pytest.mark.parametrize("force", [False, True])
def test_a_file_does_not_replace_a_pipe_or_device(force, open_target, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path(os.devnull)):
        with pytest.raises(UsageError, match="not a regular file"), open_target(path, force=force):
            pytest.fail("the target was opened")

    assert (tmp_path / "pipe").is_fifo()


@pytest.mark.parametrize("open_target", [open_output_file, *_FOLDER_FUNCTIONS])
def test_a_target_in_a_missing_folder_is_rejected(open_target, tmp_path):
    with (
        pytest.raises(UsageError, match="not a folder"),
        open_target(tmp_path / "a" / "b", force=False),
    ):
        pytest.fail("the target was opened")


@pytest.mark.parametrize("open_target", [open_output_file, *_FOLDER_FUNCTIONS])
@pytest.mark.parametrize("force", [False, True])
def test_only_streams_go_to_standard_output(open_target, force, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with (
        pytest.raises(UsageError, match="cannot be written to standard output"),
        open_target(Path("-"), force=force),
    ):
        pytest.fail("the target was opened")

    assert list_names(tmp_path) == []


def test_a_folder_can_be_called_dash_by_its_full_path(tmp_path):
    with written_folder(tmp_path / "-", force=False):
        pass

    assert list_names(tmp_path) == ["-"]


@pytest.mark.parametrize("open_target", _FOLDER_FUNCTIONS)
def test_a_folder_is_replaced_only_with_force(open_target, old_folder):
    with pytest.raises(OutputPathError, match="out exists"):
        _write_frame(open_target, old_folder)
    names_after_rejection = list_names(old_folder)
    _write_frame(open_target, old_folder, force=True)

    assert names_after_rejection == ["frame_0.ply"]
    assert list_names(old_folder) == ["frame_1.ply"]
    assert list_names(old_folder.parent) == ["out"]


def test_a_stream_is_not_written_to_a_terminal(monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    with pytest.raises(UsageError, match="pipe"), open_output_stream(Path("-"), force=False):
        pytest.fail("standard output was opened")


def test_an_interrupted_stream_on_standard_output_is_called_incomplete():
    with pytest.raises(KeyboardInterrupt, match="standard output is incomplete"):  # noqa: SIM117
        with open_output_stream(Path("-"), force=False):
            raise KeyboardInterrupt


def test_an_interrupted_growing_folder_says_what_stays(old_folder):
    with pytest.raises(KeyboardInterrupt, match="out contains the finished frames"):
        _write_frame(growing_folder, old_folder, force=True, error=KeyboardInterrupt())

    assert (old_folder / "frame_1.ply").read_bytes() == b"new"


def test_files_added_to_a_folder_during_replacement_are_kept_and_named(old_folder, capsys):
    with written_folder(old_folder, force=True) as folder:
        folder.write("frame_1.ply", b"new")
        (old_folder / "notes.txt").write_text("mine")
    messages = capsys.readouterr().err

    moved_folder = folder.moved_to
    assert list_names(old_folder) == ["frame_1.ply"]
    assert list_names(moved_folder) == ["notes.txt"]
    assert (moved_folder / "notes.txt").read_text() == "mine"
    assert messages == (
        f"quarc-ref: another program added files to {old_folder} while quarc-ref was writing it; "
        f"these files are now in {moved_folder}\n"
    )
