import os

import pytest

from quarc_ref.files import MARKER_NAME, OutputPathError, growing_folder, write_file, written_folder


def _list(folder):
    return sorted(os.listdir(folder))


def _lines(folder):
    return (folder / MARKER_NAME).read_text().splitlines()[1:]


def _make(target, *names, make=written_folder, fault=None, **options):
    with make(target, **options) as made:
        for name in names:
            made.write(name, b"made")
        if fault:
            raise fault
    return target


@pytest.fixture
def old(tmp_path):
    return _make(tmp_path / "out", "a.ply", "b.ply")


def test_a_folder_is_invisible_until_complete(tmp_path):
    with written_folder(tmp_path / "out") as made:
        made.write("a.ply", b"made")
        assert not (tmp_path / "out").exists()

    assert _list(tmp_path) == ["out"]
    assert _list(tmp_path / "out") == [MARKER_NAME, "a.ply"]


def test_files_of_a_growing_folder_appear_at_once_when_complete(tmp_path):
    with growing_folder(tmp_path / "out") as made:
        with made.open("a.ply") as file:
            file.write(b"half")
            file.flush()
            assert not (tmp_path / "out" / "a.ply").exists()
        assert (tmp_path / "out" / "a.ply").read_bytes() == b"half"


def test_a_file_is_in_the_marker_before_it_is_created(tmp_path):
    with growing_folder(tmp_path / "out") as made, made.open("a.ply"):
        assert _lines(tmp_path / "out") == ["a.ply"]


@pytest.mark.parametrize("make", [written_folder, growing_folder])
def test_an_empty_folder_is_used(make, tmp_path):
    (tmp_path / "out").mkdir()
    _make(tmp_path / "out", "a.ply", make=make)

    assert _list(tmp_path) == ["out"]
    assert _list(tmp_path / "out") == [MARKER_NAME, "a.ply"]


@pytest.mark.parametrize("fault", [OSError("disk full"), KeyboardInterrupt()])
def test_a_failed_folder_leaves_nothing_and_keeps_the_old_one(fault, old):
    for target in (old, old.parent / "new"):
        with pytest.raises(type(fault)):
            _make(target, "c.ply", replace=True, fault=fault)

    assert _list(old.parent) == ["out"]
    assert _list(old) == [MARKER_NAME, "a.ply", "b.ply"]


def test_a_growing_folder_that_fails_keeps_its_files_and_can_be_replaced(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        _make(tmp_path / "out", "a.ply", make=growing_folder, fault=KeyboardInterrupt())
    kept = _list(tmp_path / "out")
    _make(tmp_path / "out", "b.ply", make=growing_folder, replace=True)

    assert kept == [MARKER_NAME, "a.ply"]
    assert _list(tmp_path / "out") == [MARKER_NAME, "b.ply"]
    assert _lines(tmp_path / "out") == ["b.ply"]


def test_an_empty_growing_folder_is_removed(old):
    _make(old, make=growing_folder, replace=True)
    _make(old.parent / "new", make=growing_folder)

    assert _list(old.parent) == []


def test_a_growing_folder_can_keep_its_files(old):
    with growing_folder(old, replace=True, keep=True) as made:
        before = _list(old)
        made.write("a.ply", b"new")
        made.write("c.ply", b"new")

    assert before == [MARKER_NAME, "a.ply", "b.ply"]
    assert _list(old) == [MARKER_NAME, "a.ply", "b.ply", "c.ply"]
    assert _lines(old) == ["a.ply", "b.ply", "c.ply"]


@pytest.mark.parametrize("make", [written_folder, growing_folder])
def test_a_folder_is_replaced_only_on_request(make, old):
    with pytest.raises(OutputPathError, match="out exists") as caught:
        _make(old, make=make)
    _make(old, "c.ply", make=make, replace=True)

    assert caught.value.replaceable
    assert _list(old) == [MARKER_NAME, "c.ply"]
    assert _list(old.parent) == ["out"]


@pytest.mark.parametrize("make", [written_folder, growing_folder])
def test_a_folder_with_foreign_files_is_unchanged(make, old):
    (old / "thesis.tex").write_text("mine")
    with pytest.raises(OutputPathError, match=r"out contains thesis\.tex, which") as caught:
        _make(old, make=make, replace=True)

    assert not caught.value.replaceable
    assert _list(old) == [MARKER_NAME, "a.ply", "b.ply", "thesis.tex"]


@pytest.mark.parametrize("make", [written_folder, growing_folder])
@pytest.mark.parametrize("kind", ["file", "link"])
def test_a_file_or_a_link_is_not_treated_as_a_folder(kind, make, old):
    place = old.parent / kind
    place.write_text("mine") if kind == "file" else place.symlink_to(old)
    with pytest.raises(OutputPathError, match="is a symbolic link or not a folder"):
        _make(place, make=make, replace=True)

    assert place.is_symlink() == (kind == "link")
    assert _list(old) == [MARKER_NAME, "a.ply", "b.ply"]


@pytest.mark.parametrize("make", [written_folder, growing_folder])
def test_a_folder_being_written_by_another_process_is_rejected(make, tmp_path):
    pytest.importorskip("fcntl")
    with growing_folder(tmp_path / "out") as made:
        made.write("a.ply", b"made")
        with pytest.raises(OutputPathError, match="being written by another process"):
            _make(tmp_path / "out", make=make, replace=True)

    assert _list(tmp_path / "out") == [MARKER_NAME, "a.ply"]


def test_nested_folders_have_their_own_markers_and_are_removed_together(tmp_path):
    for replace in (False, True):
        with written_folder(tmp_path / "out", replace=replace) as made:
            with made.folder("inner") as inner:
                inner.write("a.ply", b"made")
            made.write("b.ply", b"made")
    lines = _lines(tmp_path / "out")
    _make(tmp_path / "out", "c.ply", replace=True)

    assert lines == ["inner/", "b.ply"]
    assert _list(tmp_path) == ["out"]
    assert _list(tmp_path / "out") == [MARKER_NAME, "c.ply"]


def test_a_folder_nested_too_deeply_is_foreign(tmp_path):
    with (
        written_folder(tmp_path / "out") as made,
        made.folder("inner") as inner,
        inner.folder("innermost") as innermost,
    ):
        innermost.write("a.ply", b"made")
    with pytest.raises(OutputPathError, match="inner contains innermost"):
        _make(tmp_path / "out", replace=True)


@pytest.mark.parametrize("name", ["../a", "a/b", "a\\b", "..", ".", "", ".hidden", "C:a", "a\nb"])
def test_an_unsafe_name_is_rejected(name, tmp_path):
    with growing_folder(tmp_path / "out") as made, pytest.raises(ValueError, match="plain"):
        made.write(name, b"made")

    assert _list(tmp_path) == []


@pytest.mark.parametrize("when", ["first", "second"])
@pytest.mark.parametrize("fault", [OSError("no"), KeyboardInterrupt()])
def test_an_old_folder_is_kept_if_the_new_one_cannot_replace_it(when, fault, old, monkeypatch):
    renames, rename = [], type(old).rename

    def fail(path, target):
        renames.append(path)
        if len(renames) == (1 if when == "first" else 2):
            raise fault
        return rename(path, target)

    with monkeypatch.context() as patch:
        patch.setattr(type(old), "rename", fail)
        with pytest.raises(type(fault)):
            _make(old, "c.ply", replace=True)

    assert _list(old.parent) == ["out"]
    assert _list(old) == [MARKER_NAME, "a.ply", "b.ply"]


def test_foreign_files_added_to_the_old_folder_are_kept(old):
    with written_folder(old, replace=True) as made:
        made.write("c.ply", b"made")
        (old / "notes.txt").write_text("mine")

    assert _list(old) == [MARKER_NAME, "c.ply"]
    assert _list(made.moved_to) == ["notes.txt"]
    _make(old, "d.ply", replace=True)
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
