from pathlib import Path

import pytest

from quarc_ref.cli.faults import UsageError
from quarc_ref.cli.targets import (
    grown_folder,
    put_file,
    written_file,
    written_folder,
    written_stream,
)

_MADE = ("frame_*.ply",)


def _names(folder):
    return sorted(path.name for path in folder.iterdir())


def _write_half(target, *, force, fault):
    with written_file(target, force=force) as sink:
        sink.write(b"half")
        raise fault


def _write_frame(target, *, force=False, fault=None):
    with written_folder(target, _MADE, force=force) as folder:
        (folder / "frame_1.ply").write_text("new")
        if fault:
            raise fault


@pytest.fixture
def old_folder(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "frame_0.ply").write_text("old")
    return tmp_path / "out"


def test_a_file_is_not_seen_before_it_is_whole(tmp_path):
    target = tmp_path / "a.quarc"
    with written_file(target, force=False) as sink:
        sink.write(b"half")
        assert not target.exists()
        sink.write(b"whole")

    assert target.read_bytes() == b"halfwhole"
    assert _names(tmp_path) == ["a.quarc"]


@pytest.mark.parametrize("fault", [OSError("disk full"), KeyboardInterrupt()])
@pytest.mark.parametrize("force", [False, True])
def test_an_interrupted_file_leaves_nothing_and_the_old_one_whole(fault, force, tmp_path):
    if force:
        (tmp_path / "a.quarc").write_bytes(b"old")
    with pytest.raises(type(fault)):
        _write_half(tmp_path / "a.quarc", force=force, fault=fault)

    assert [path.read_bytes() for path in tmp_path.iterdir()] == ([b"old"] if force else [])


def test_a_file_that_exists_is_replaced_by_force_alone(tmp_path):
    target = tmp_path / "a.quarc"
    target.write_bytes(b"old")
    with pytest.raises(UsageError, match="--force"), written_file(target, force=False):
        pytest.fail("the target was opened")
    kept = target.read_bytes()
    with written_file(target, force=True) as sink:
        sink.write(b"new")

    assert kept == b"old"
    assert target.read_bytes() == b"new"


def test_a_file_takes_no_folder_s_place(old_folder):
    with pytest.raises(UsageError, match="folder"), written_file(old_folder, force=True):
        pytest.fail("the target was opened")

    assert _names(old_folder) == ["frame_0.ply"]


@pytest.mark.parametrize(
    "make", [written_file, lambda t, force: written_folder(t, (), force=force)]
)
def test_a_target_in_no_folder_is_refused(make, tmp_path):
    with pytest.raises(UsageError, match="no folder"), make(tmp_path / "a" / "b", force=False):
        pytest.fail("the target was opened")


@pytest.mark.parametrize(
    "make",
    [
        written_file,
        lambda t, force: written_folder(t, (), force=force),
        lambda t, force: grown_folder(t, (), force=force),
    ],
)
@pytest.mark.parametrize("force", [False, True])
def test_what_is_no_stream_does_not_go_to_standard_output(make, force, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with (
        pytest.raises(UsageError, match="cannot go to standard output"),
        make(Path("-"), force=force),
    ):
        pytest.fail("the target was opened")

    assert _names(tmp_path) == []


def test_a_folder_may_have_the_name_of_standard_output_by_its_whole_path(tmp_path):
    with written_folder(tmp_path / "-", (), force=False):
        pass

    assert _names(tmp_path) == ["-"]


def test_a_folder_is_not_seen_before_it_is_whole(tmp_path):
    with written_folder(tmp_path / "out", _MADE, force=False) as folder:
        (folder / "frame_0.ply").write_text("new")
        assert not (tmp_path / "out").exists()

    assert _names(tmp_path) == ["out"]
    assert _names(tmp_path / "out") == ["frame_0.ply"]


@pytest.mark.parametrize("fault", [OSError("disk full"), KeyboardInterrupt()])
def test_an_interrupted_folder_leaves_nothing_and_the_old_one_whole(fault, old_folder):
    with pytest.raises(type(fault)):
        _write_frame(old_folder, force=True, fault=fault)
    with pytest.raises(type(fault)):
        _write_frame(old_folder.parent / "other", fault=fault)

    assert _names(old_folder.parent) == ["out"]
    assert _names(old_folder) == ["frame_0.ply"]


def test_a_folder_is_replaced_by_force_alone(old_folder):
    with pytest.raises(UsageError, match="--force"):
        _write_frame(old_folder)
    kept = _names(old_folder)
    _write_frame(old_folder, force=True)

    assert kept == ["frame_0.ply"]
    assert _names(old_folder) == ["frame_1.ply"]
    assert _names(old_folder.parent) == ["out"]


def test_an_empty_folder_is_nothing_to_replace(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    _write_frame(tmp_path / "a")
    with grown_folder(tmp_path / "b", _MADE, force=False) as folder:
        put_file(folder / "frame_1.ply", b"new")

    assert _names(tmp_path) == ["a", "b"]
    assert _names(tmp_path / "a") == _names(tmp_path / "b") == ["frame_1.ply"]


def test_force_does_not_remove_what_the_command_has_not_made(old_folder):
    (old_folder / "thesis.tex").write_text("mine")
    with pytest.raises(UsageError, match=r"thesis\.tex"):
        _write_frame(old_folder, force=True)

    assert _names(old_folder) == ["frame_0.ply", "thesis.tex"]


def test_force_takes_neither_a_file_nor_a_link_for_a_folder(old_folder):
    (old_folder.parent / "file").write_text("mine")
    (old_folder.parent / "link").symlink_to(old_folder)
    for name in ("file", "link"):
        with pytest.raises(UsageError, match="no folder of its own"):
            _write_frame(old_folder.parent / name, force=True)

    assert _names(old_folder) == ["frame_0.ply"]
    assert (old_folder.parent / "file").read_text() == "mine"


def test_an_old_folder_comes_back_if_the_new_one_cannot_take_its_place(old_folder):
    def remove_the_new(target):
        with written_folder(target, _MADE, force=True) as folder:
            folder.rmdir()

    with pytest.raises(FileNotFoundError):
        remove_the_new(old_folder)

    assert _names(old_folder.parent) == ["out"]
    assert _names(old_folder) == ["frame_0.ply"]


def test_a_stream_takes_no_folder_s_place(old_folder):
    with pytest.raises(UsageError, match="folder"), written_stream(old_folder, force=True):
        pytest.fail("the target was opened")

    assert _names(old_folder) == ["frame_0.ply"]


def test_a_terminal_is_sent_no_stream(monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    with pytest.raises(UsageError, match="pipe"), written_stream(Path("-"), force=False):
        pytest.fail("standard output was opened")


def test_files_of_a_growing_folder_are_seen_at_once_and_whole(old_folder):
    def write_one():
        with grown_folder(old_folder, _MADE, force=True) as folder:
            assert _names(old_folder) == []
            put_file(folder / "frame_1.ply", b"new")
            assert _names(old_folder) == ["frame_1.ply"]
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match="holds the frames"):
        write_one()

    assert (old_folder / "frame_1.ply").read_bytes() == b"new"


def test_a_growing_folder_is_emptied_neither_unasked_nor_of_what_is_not_its_own(old_folder):
    with pytest.raises(UsageError, match="--force"), grown_folder(old_folder, _MADE, force=False):
        pytest.fail("the folder was opened")
    (old_folder / "thesis.tex").write_text("mine")
    with pytest.raises(UsageError, match="thesis"), grown_folder(old_folder, _MADE, force=True):
        pytest.fail("the folder was opened")

    assert _names(old_folder) == ["frame_0.ply", "thesis.tex"]
