import os

import pytest

from quarc_ref.files import MARKER_NAME, OutputPathError, growing_folder, written_folder


@pytest.fixture
def made(tmp_path):
    with growing_folder(tmp_path / "out") as made:
        made.write("a.ply", b"made")
    return tmp_path / "out"


def _replace(folder):
    with written_folder(folder, replace=True) as made:
        made.write("new.ply", b"made")


@pytest.mark.parametrize(
    "line", [b"../victim", b"/victim", b"..", b".", b"", b"a/b", b"a//", b"a\\b", b"C:a", b"\xff",
             b"a\0", b"a\r", b".a", b"*"]
)  # fmt: skip
def test_a_marker_with_an_unsafe_name_is_not_trusted(line, made):
    (made.parent / "victim").write_text("mine")
    with (made / MARKER_NAME).open("ab") as marker:
        marker.write(line + b"\n")
    with pytest.raises(OutputPathError, match="damaged"):
        _replace(made)

    assert sorted(os.listdir(made)) == [MARKER_NAME, "a.ply"]
    assert (made.parent / "victim").read_text() == "mine"


@pytest.mark.parametrize("text", ["a.ply\n", "other\na.ply\n", "x", "[1, 2]\n"])
def test_a_foreign_marker_is_not_trusted(text, made):
    (made / MARKER_NAME).write_text(text)
    with pytest.raises(OutputPathError, match="damaged"):
        _replace(made)

    assert sorted(os.listdir(made)) == [MARKER_NAME, "a.ply"]


@pytest.mark.parametrize("kind", ["link", "folder", "pipe"])
def test_a_marker_must_be_a_regular_file(kind, made, tmp_path):
    (made / MARKER_NAME).rename(tmp_path / "marker")
    if kind == "link":
        (made / MARKER_NAME).symlink_to(tmp_path / "marker")
    elif kind == "folder":
        (made / MARKER_NAME).mkdir()
    else:
        os.mkfifo(made / MARKER_NAME)
    with pytest.raises(OutputPathError, match="quarc-ref-made is"):
        _replace(made)

    assert sorted(os.listdir(made)) == [MARKER_NAME, "a.ply"]


def test_an_incomplete_line_names_nothing(made):
    (made / "b").write_text("mine")
    with (made / MARKER_NAME).open("ab") as marker:
        marker.write(b"b")
    with pytest.raises(OutputPathError, match="contains b"):
        _replace(made)
    (made / "b").unlink()
    with growing_folder(made, replace=True, keep=True) as folder:
        folder.write("c.ply", b"made")

    assert (made / MARKER_NAME).read_text().splitlines()[1:] == ["a.ply", "c.ply"]


@pytest.mark.parametrize("size", [0, 10])
def test_a_folder_with_an_incomplete_first_line_counts_as_empty(size, made):
    (made / "a.ply").unlink()
    (made / MARKER_NAME).write_bytes((made / MARKER_NAME).read_bytes()[:size])
    _replace(made)

    assert sorted(os.listdir(made)) == [MARKER_NAME, "new.ply"]
