import os
import stat
from pathlib import Path

import pytest

from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.stream_targets import (
    open_segments_folder,
    open_stream_file,
    reject_stream_path,
)
from quarc_ref.files import OutputPathError
from tests.cli.commands import list_names, make_folder


@pytest.mark.parametrize("live", [False, True])
def test_a_complete_stream_survives_a_power_failure(live, tmp_path, monkeypatch):
    target, sync_calls = tmp_path / "a.quarc", []

    def record_sync(descriptor):
        is_folder = stat.S_ISDIR(os.fstat(descriptor).st_mode)
        sync_calls.append(("folder" if is_folder else "file", list_names(tmp_path)))

    monkeypatch.setattr(os, "fsync", record_sync)
    with open_stream_file(target, force=False, live=live, resume=False) as (_, file):
        file.write(b"stream")

    written_name = "a.quarc" if live else "a.quarc.part"
    assert sync_calls == [("file", [written_name]), ("folder", ["a.quarc"])]


def test_an_interrupted_stream_stays_and_is_not_synced(tmp_path, monkeypatch):
    error = OSError("disk full")

    def interrupt_writing():
        with open_stream_file(
            tmp_path / "a.quarc", force=False, live=False, resume=False
        ) as path_and_file:
            path_and_file[1].write(b"half")
            path_and_file[1].flush()
            raise error

    monkeypatch.setattr(os, "fsync", lambda _: pytest.fail("it is not whole"))
    with pytest.raises(OSError, match="disk full"):
        interrupt_writing()

    assert (tmp_path / "a.quarc.part").read_bytes() == b"half"


@pytest.mark.parametrize(
    ("existing_name", "resumed_name"),
    [
        ("a.quarc.training", "a.quarc"),  # a live encode, interrupted in frame 0
        ("a.quarc", "a.quarc"),
        ("a.quarc.part", "a.quarc.part"),
        ("a.quarc.part.training", "a.quarc.part"),
        ("other", "a.quarc.part"),
    ],
)
def test_the_file_of_an_interrupted_encode_is_resumed(existing_name, resumed_name, tmp_path):
    (tmp_path / existing_name).write_bytes(b"begun")

    target = tmp_path / "a.quarc"
    with open_stream_file(target, force=False, live=False, resume=True) as (path, file):
        file.write(b"continued")

    assert path.name == resumed_name


@pytest.mark.parametrize("name", ["a.quarc.part", "a.quarc.part.training"])
def test_an_encode_that_was_not_live_is_not_resumed_live(name, tmp_path):
    (tmp_path / name).write_bytes(b"begun")

    with (
        pytest.raises(UsageError, match="without --live to continue"),
        open_stream_file(tmp_path / "a.quarc", force=False, live=True, resume=True),
    ):
        pytest.fail("the target was opened")

    assert list_names(tmp_path) == [name]


@pytest.mark.parametrize("resume", [False, True])
@pytest.mark.parametrize("name", ["a.quarc.part", "a.quarc.part.training"])
def test_an_encode_without_segments_is_not_ignored_by_one_with_segments(name, resume, tmp_path):
    (tmp_path / name).write_bytes(b"begun")

    with (
        pytest.raises(UsageError, match="use --resume without --segments to continue"),
        open_segments_folder(tmp_path / "a.quarc", force=False, resume=resume),
    ):
        pytest.fail("the folder was opened")

    assert list_names(tmp_path) == [name]


def test_an_encode_with_segments_is_not_ignored_by_one_without(tmp_path):
    make_folder(tmp_path / "a.quarc.segments", "frames_000000_000001.quarc")

    with (
        pytest.raises(UsageError, match="use --resume with --segments to continue"),
        open_stream_file(tmp_path / "a.quarc", force=False, live=False, resume=True),
    ):
        pytest.fail("the target was opened")

    assert list_names(tmp_path) == ["a.quarc.segments"]


@pytest.mark.parametrize("options", [{"live": True}, {"live": False}])
def test_a_stream_is_not_written_through_a_link(options, tmp_path):
    (tmp_path / "victim").write_text("mine")
    name = "a.quarc" if options["live"] else "a.quarc.part"
    (tmp_path / name).symlink_to(tmp_path / "victim")
    with (
        pytest.raises(OutputPathError, match="symbolic link"),
        open_stream_file(tmp_path / "a.quarc", force=True, resume=True, **options),
    ):
        pytest.fail("the target was opened")

    assert (tmp_path / "victim").read_text() == "mine"


def test_only_the_segments_and_their_remains_are_removed(tmp_path):
    target = tmp_path / "a.quarc"
    with open_segments_folder(target, force=False, resume=False) as folder:
        for name in ("frames_0.quarc", "frames_0.quarc.training"):
            folder.register(name).write_bytes(b"made")
        leftover_file = folder.path / ".frames_0.quarc.training.0123456789abcdef.part"
        leftover_file.write_bytes(b"left")
        (folder.path / "frames_1.quarc").write_bytes(b"mine")

    assert list_names(tmp_path / "a.quarc.segments") == ["frames_1.quarc"]


@pytest.mark.parametrize("name", [".", "", "/", "folder"])
@pytest.mark.parametrize("resume", [False, True])
@pytest.mark.parametrize("live", [False, True])
def test_a_folder_is_no_path_of_a_stream(name, resume, live, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    target = Path(name)

    with pytest.raises(UsageError, match=r"is a folder: give the path of a file"):
        open_stream_file(target, force=True, live=live, resume=resume).__enter__()
    with pytest.raises(UsageError, match=r"is a folder: give the path of a file"):
        reject_stream_path(Path("log.jsonl"), target)
    assert list_names(tmp_path) == ["folder"]
