import errno
import os
from contextlib import suppress
from pathlib import Path

import pytest

from quarc_ref.files import MARKER_NAME, OutputPathError, growing_folder, write_file, written_folder


def _list(folder):
    return sorted(os.listdir(folder))


def _read_marker_lines(folder):
    return (folder / MARKER_NAME).read_text().splitlines()[1:]


def _make_folder(target, *names, make=written_folder, error=None, **options):
    with make(target, **options) as made:
        for name in names:
            made.write(name, b"made")
        if error:
            raise error
    return target


@pytest.fixture
def old_folder(tmp_path):
    return _make_folder(tmp_path / "out", "a.ply", "b.ply")


def test_a_folder_is_invisible_until_complete(tmp_path):
    with written_folder(tmp_path / "out") as made:
        made.write("a.ply", b"made")
        assert not (tmp_path / "out").exists()

    assert _list(tmp_path) == ["out"]
    assert _list(tmp_path / "out") == [MARKER_NAME, "a.ply"]


@pytest.mark.parametrize("make", [written_folder, growing_folder])
def test_an_error_names_the_final_path_of_a_file(make, tmp_path):
    error = OSError(errno.ENOSPC, "No space left on device")
    with (
        pytest.raises(OSError, match="No space"),
        make(tmp_path / "out") as made,
        made.open("a.ply"),
    ):
        raise error

    assert error.filename == str(tmp_path / "out" / "a.ply")


def test_files_of_a_growing_folder_appear_at_once_when_complete(tmp_path):
    with growing_folder(tmp_path / "out") as made:
        with made.open("a.ply") as file:
            file.write(b"half")
            file.flush()
            assert not (tmp_path / "out" / "a.ply").exists()
        assert (tmp_path / "out" / "a.ply").read_bytes() == b"half"


def test_a_file_is_in_the_marker_before_it_is_created(tmp_path):
    with growing_folder(tmp_path / "out") as made, made.open("a.ply"):
        assert _read_marker_lines(tmp_path / "out") == ["a.ply"]


@pytest.mark.parametrize("make", [written_folder, growing_folder])
def test_an_empty_folder_is_used(make, tmp_path):
    (tmp_path / "out").mkdir()
    _make_folder(tmp_path / "out", "a.ply", make=make)

    assert _list(tmp_path) == ["out"]
    assert _list(tmp_path / "out") == [MARKER_NAME, "a.ply"]


@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()])
def test_a_failed_folder_leaves_nothing_and_keeps_the_old_one(error, old_folder):
    for target in (old_folder, old_folder.parent / "new"):
        with pytest.raises(type(error)):
            _make_folder(target, "c.ply", replace=True, error=error)

    assert _list(old_folder.parent) == ["out"]
    assert _list(old_folder) == [MARKER_NAME, "a.ply", "b.ply"]


def test_a_growing_folder_that_fails_keeps_its_files_and_can_be_replaced(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        _make_folder(tmp_path / "out", "a.ply", make=growing_folder, error=KeyboardInterrupt())
    kept_contents = _list(tmp_path / "out")
    _make_folder(tmp_path / "out", "b.ply", make=growing_folder, replace=True)

    assert kept_contents == [MARKER_NAME, "a.ply"]
    assert _list(tmp_path / "out") == [MARKER_NAME, "b.ply"]
    assert _read_marker_lines(tmp_path / "out") == ["b.ply"]


def test_an_empty_growing_folder_is_removed(tmp_path):
    _make_folder(tmp_path / "new", make=growing_folder)

    assert _list(tmp_path) == []


@pytest.mark.parametrize("error", [None, OSError("no stream")])
def test_the_files_of_a_growing_folder_stay_until_the_first_new_file(error, old_folder):
    with suppress(OSError):
        _make_folder(old_folder, make=growing_folder, replace=True, error=error)
    unchanged_contents = _list(old_folder), _read_marker_lines(old_folder)
    with growing_folder(old_folder, replace=True) as made, made.open("c.ply"):
        contents_while_writing = _read_marker_lines(old_folder)

    assert unchanged_contents == ([MARKER_NAME, "a.ply", "b.ply"], ["a.ply", "b.ply"])
    assert contents_while_writing == ["c.ply"]
    assert _list(old_folder) == [MARKER_NAME, "c.ply"]


def test_a_growing_folder_can_keep_its_files(old_folder):
    with growing_folder(old_folder, replace=True, keep=True) as made:
        contents_before = _list(old_folder)
        made.write("a.ply", b"new")
        made.write("c.ply", b"new")

    assert contents_before == [MARKER_NAME, "a.ply", "b.ply"]
    assert _list(old_folder) == [MARKER_NAME, "a.ply", "b.ply", "c.ply"]
    assert _read_marker_lines(old_folder) == ["a.ply", "b.ply", "c.ply"]


@pytest.mark.parametrize("make", [written_folder, growing_folder])
def test_a_folder_is_replaced_only_on_request(make, old_folder):
    with pytest.raises(OutputPathError, match="out exists") as error_info:
        _make_folder(old_folder, make=make)
    _make_folder(old_folder, "c.ply", make=make, replace=True)

    assert error_info.value.replaceable
    assert _list(old_folder) == [MARKER_NAME, "c.ply"]
    assert _list(old_folder.parent) == ["out"]


@pytest.mark.parametrize("make", [written_folder, growing_folder])
def test_a_folder_with_foreign_files_is_unchanged(make, old_folder):
    (old_folder / "thesis.tex").write_text("mine")
    with pytest.raises(OutputPathError, match=r"out contains thesis\.tex, which") as error_info:
        _make_folder(old_folder, make=make, replace=True)

    assert not error_info.value.replaceable
    assert _list(old_folder) == [MARKER_NAME, "a.ply", "b.ply", "thesis.tex"]


@pytest.mark.parametrize("make", [written_folder, growing_folder])
@pytest.mark.parametrize("kind", ["file", "link"])
def test_a_file_or_a_link_is_not_treated_as_a_folder(kind, make, old_folder):
    place = old_folder.parent / kind
    place.write_text("mine") if kind == "file" else place.symlink_to(old_folder)
    with pytest.raises(OutputPathError, match="is a symbolic link, or is not a folder"):
        _make_folder(place, make=make, replace=True)

    assert place.is_symlink() == (kind == "link")
    assert _list(old_folder) == [MARKER_NAME, "a.ply", "b.ply"]


@pytest.mark.parametrize("make", [written_folder, growing_folder])
def test_a_folder_being_written_by_another_process_is_rejected(make, tmp_path):
    pytest.importorskip("fcntl")
    with growing_folder(tmp_path / "out") as made:
        made.write("a.ply", b"made")
        with pytest.raises(OutputPathError, match="being written by another process"):
            _make_folder(tmp_path / "out", make=make, replace=True)

    assert _list(tmp_path / "out") == [MARKER_NAME, "a.ply"]


def test_nested_folders_have_their_own_markers_and_are_removed_together(tmp_path):
    for replace in (False, True):
        with written_folder(tmp_path / "out", replace=replace) as made:
            with made.create_subfolder("inner") as inner:
                inner.write("a.ply", b"made")
            made.write("b.ply", b"made")
    lines = _read_marker_lines(tmp_path / "out")
    _make_folder(tmp_path / "out", "c.ply", replace=True)

    assert lines == ["inner/", "b.ply"]
    assert _list(tmp_path) == ["out"]
    assert _list(tmp_path / "out") == [MARKER_NAME, "c.ply"]


def test_a_folder_nested_too_deeply_is_foreign(tmp_path):
    with (
        written_folder(tmp_path / "out") as made,
        made.create_subfolder("inner") as inner,
        inner.create_subfolder("innermost") as innermost,
    ):
        innermost.write("a.ply", b"made")
    with pytest.raises(OutputPathError, match="inner contains innermost"):
        _make_folder(tmp_path / "out", replace=True)


@pytest.mark.parametrize("name", ["../a", "a/b", "a\\b", "..", ".", "", ".hidden", "C:a", "a\nb"])
def test_an_unsafe_name_is_rejected(name, tmp_path):
    with growing_folder(tmp_path / "out") as made, pytest.raises(ValueError, match="plain"):
        made.write(name, b"made")

    assert _list(tmp_path) == []


@pytest.mark.parametrize("when", ["first", "second"])
@pytest.mark.parametrize("error", [OSError("no"), KeyboardInterrupt()])
def test_an_old_folder_is_kept_if_the_new_one_cannot_replace_it(
    when, error, old_folder, monkeypatch
):
    renames, rename = [], type(old_folder).rename

    def fail(path, target):
        renames.append(path)
        if len(renames) == (1 if when == "first" else 2):
            raise error
        return rename(path, target)

    with monkeypatch.context() as patch:
        patch.setattr(type(old_folder), "rename", fail)
        with pytest.raises(type(error)):
            _make_folder(old_folder, "c.ply", replace=True)

    assert _list(old_folder.parent) == ["out"]
    assert _list(old_folder) == [MARKER_NAME, "a.ply", "b.ply"]


def test_foreign_files_added_to_the_old_folder_are_kept(old_folder):
    with written_folder(old_folder, replace=True) as made:
        made.write("c.ply", b"made")
        (old_folder / "notes.txt").write_text("mine")

    assert _list(old_folder) == [MARKER_NAME, "c.ply"]
    assert _list(made.moved_to) == ["notes.txt"]
    _make_folder(old_folder, "d.ply", replace=True)
    assert _list(made.moved_to) == ["notes.txt"]


@pytest.mark.parametrize("replace", [False, True])
def test_a_foreign_folder_created_in_the_meantime_is_not_replaced(replace, tmp_path):
    target = tmp_path / "out"

    def make():
        with written_folder(target, replace=replace) as made:
            made.write("c.ply", b"made")
            target.mkdir()
            write_file(target / "mine.txt", b"mine")

    with pytest.raises(OutputPathError, match="out"):
        make()

    assert _list(tmp_path) == ["out"]
    assert _list(target) == ["mine.txt"]


@pytest.mark.parametrize("name", [".", ""])
def test_the_current_folder_is_rejected_before_anything_is_written(name, tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")

    with (
        pytest.raises(OutputPathError, match="is the current folder"),
        written_folder(Path(name)),
    ):
        pytest.fail("the folder was opened")
    with growing_folder(Path(name)) as folder:  # writes into the folder without replacing it
        folder.write("a", b"")
    assert (tmp_path / "here" / "a").exists()


def test_a_mount_point_is_rejected_before_anything_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(os.path, "ismount", lambda path: path == tmp_path)

    with (
        pytest.raises(OutputPathError, match="is a mount point"),
        written_folder(tmp_path),
    ):
        pytest.fail("the folder was opened")


def test_a_parent_in_which_no_folder_can_be_made_is_an_error(tmp_path, monkeypatch):
    errors = [AssertionError("tried again"), FileNotFoundError("as in /proc")]

    def refuse(_):
        raise errors.pop()

    monkeypatch.setattr(Path, "mkdir", refuse)

    with pytest.raises(FileNotFoundError), written_folder(tmp_path / "out"):
        pytest.fail("the folder was made")


def test_a_file_is_copied_where_the_file_system_has_no_hard_links(tmp_path, monkeypatch):
    def reject(*_):
        raise OSError(errno.EXDEV, "Invalid cross-device link")

    monkeypatch.setattr(os, "link", reject)
    (tmp_path / "source").write_bytes(b"recording")
    with written_folder(tmp_path / "folder") as folder:
        path = folder.link("copy", tmp_path / "source")

    assert path.name == "copy"
    assert (tmp_path / "folder" / "copy").read_bytes() == b"recording"
    assert (tmp_path / "source").read_bytes() == b"recording"
