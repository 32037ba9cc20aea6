import errno
import os
import stat
from pathlib import Path

import pytest

from quarc_ref.files import atomic_file, temporary_paths, write_file

_NAME = r"\.a\.bin\.[0-9a-f]{16}\.part"


def _list(folder):
    return sorted(os.listdir(folder))


def test_a_file_is_written_next_to_its_target_under_a_random_name(tmp_path):
    names = set()
    for data in (b"one", b"two"):
        with atomic_file(tmp_path / "a.bin") as file:
            file.write(data)
            names |= set(_list(tmp_path)) - {"a.bin"}

    assert len(names) == 2
    assert all(
        temporary_paths.is_temporary_name(name, "a.bin", temporary_paths.PART_SUFFIX)
        for name in names
    )
    assert (tmp_path / "a.bin").read_bytes() == b"two"
    assert _list(tmp_path) == ["a.bin"]


@pytest.mark.parametrize("name", ["a" * 255, "a" * 232, "a" * 233, "\u65e5" * 85])
def test_a_name_may_be_as_long_as_the_file_system_allows(name, tmp_path):
    with atomic_file(tmp_path / name) as file:
        file.write(b"data")
        (temporary_name,) = _list(tmp_path)
    suffix = temporary_paths.PART_SUFFIX

    assert temporary_paths.is_temporary_name(temporary_name, name, suffix)
    assert not temporary_paths.is_temporary_name(temporary_name, f"{name[:-1]}b", suffix)
    assert _list(tmp_path) == [name]


@pytest.mark.parametrize("dangles", [False, True])
def test_a_link_at_the_temporary_name_is_not_followed(dangles, tmp_path, monkeypatch):
    victim = tmp_path / "victim"
    if not dangles:
        victim.write_text("mine")
    planted_name = tmp_path / ".a.bin.0000000000000000.part"
    planted_name.symlink_to(victim)
    numbers = iter(["0" * 16, "1" * 16])
    monkeypatch.setattr(temporary_paths.secrets, "token_hex", lambda _: next(numbers))
    write_file(tmp_path / "a.bin", b"data")

    assert (tmp_path / "a.bin").read_bytes() == b"data"
    assert planted_name.is_symlink()
    assert victim.exists() != dangles
    assert dangles or victim.read_text() == "mine"


def test_a_link_at_the_target_is_replaced_and_not_followed(tmp_path):
    victim = tmp_path / "victim"
    victim.write_text("mine")
    (tmp_path / "a.bin").symlink_to(victim)
    write_file(tmp_path / "a.bin", b"data")

    assert victim.read_text() == "mine"
    assert not (tmp_path / "a.bin").is_symlink()


@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()])
def test_a_failed_write_keeps_the_old_file_and_nothing_else(error, tmp_path):
    def fail():
        with atomic_file(tmp_path / "a.bin") as file:
            file.write(b"half")
            raise error

    (tmp_path / "a.bin").write_text("old")
    with pytest.raises(type(error)):
        fail()

    assert _list(tmp_path) == ["a.bin"]
    assert (tmp_path / "a.bin").read_text() == "old"


def test_a_file_that_cannot_be_renamed_is_removed(tmp_path):
    (tmp_path / "a.bin").mkdir()
    with pytest.raises(IsADirectoryError):
        write_file(tmp_path / "a.bin", b"data")

    assert _list(tmp_path) == ["a.bin"]
    assert _list(tmp_path / "a.bin") == []


@pytest.mark.skipif(os.name == "nt", reason="no permissions")
def test_a_file_has_the_permissions_of_a_new_one(tmp_path):
    (tmp_path / "a.bin").write_text("old")
    (tmp_path / "a.bin").chmod(0o600)
    contents_before = os.umask(0o027)
    try:
        write_file(tmp_path / "a.bin", b"data")
    finally:
        os.umask(contents_before)

    assert stat.S_IMODE((tmp_path / "a.bin").stat().st_mode) == 0o640


@pytest.mark.parametrize("durable", [False, True])
def test_a_durable_file_is_synced_before_the_rename_and_its_folder_after(
    durable, tmp_path, monkeypatch
):
    synced = []

    def note(number):
        kind = "folder" if stat.S_ISDIR(os.fstat(number).st_mode) else "file"
        synced.append((kind, (tmp_path / "a.bin").exists()))

    monkeypatch.setattr(os, "fsync", note)
    with atomic_file(tmp_path / "a.bin", durable=durable) as file:
        file.write(b"data")

    assert synced == ([("file", False), ("folder", True)] if durable else [])


@pytest.mark.parametrize(
    ("error", "name"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "a.bin"),
        (OSError(errno.EIO, "Input/output error"), None),  # may be that of a file that is read
        (OSError(errno.ENOSPC, "No space left on device", "b.bin"), "b.bin"),
    ],
)
def test_the_error_of_a_full_disk_names_the_file_that_is_written(
    error, name, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OSError, match=error.strerror) as error_info, atomic_file(Path("a.bin")):
        raise error

    assert error_info.value.filename == name
    assert _list(tmp_path) == []


def test_a_file_that_cannot_be_created_is_named(tmp_path):
    target = tmp_path / "missing" / "a.bin"
    with pytest.raises(FileNotFoundError) as error_info:
        write_file(target, b"data")

    assert error_info.value.filename == str(target)
