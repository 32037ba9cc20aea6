"""Tests of log files: kept lines, unfinished lines, and empty files."""

from contextlib import suppress

import pytest

from quarc_ref.files import OutputPathError, open_log


@pytest.mark.parametrize(
    ("existing", "keep", "expected"),
    [
        (b"", True, b"new\n"),
        (b"old\n", True, b"old\nnew\n"),
        (b"old\ntruncat", True, b"old\ntruncat\nnew\n"),
        (b"old\ntruncat", False, b"new\n"),
    ],
)
def test_a_new_line_follows_the_kept_lines(existing, keep, expected, tmp_path):
    path = tmp_path / "log.jsonl"
    path.write_bytes(existing)
    with open_log(path, keep=keep) as log:
        log.write("new\n")

    assert path.read_bytes() == expected


@pytest.mark.parametrize("error", [None, KeyboardInterrupt()])
def test_an_empty_log_is_removed(error, tmp_path):
    with suppress(KeyboardInterrupt), open_log(tmp_path / "log.jsonl", keep=True):
        if error is not None:
            raise error

    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("keep", [False, True])
def test_a_log_does_not_change_before_its_first_line(keep, tmp_path):
    path = tmp_path / "log.jsonl"
    path.write_bytes(b"old\ntruncat")
    with open_log(path, keep=keep):
        pass

    assert path.read_bytes() == b"old\ntruncat"


def test_an_existing_empty_log_stays(tmp_path):
    path = tmp_path / "log.jsonl"
    path.touch()
    with open_log(path, keep=False):
        pass

    assert path.exists()


@pytest.mark.parametrize("keep", [False, True])
def test_a_log_of_another_process_is_rejected(keep, tmp_path):
    pytest.importorskip("fcntl")
    path = tmp_path / "log.jsonl"
    with open_log(path, keep=False) as log:
        with (
            pytest.raises(OutputPathError, match="being written by another process"),
            open_log(path, keep=keep),
        ):
            pytest.fail("the log was opened twice")
        log.write("new\n")

    assert path.read_bytes() == b"new\n"


def test_a_line_of_another_program_is_not_overwritten(tmp_path):
    path = tmp_path / "log.jsonl"
    with open_log(path, keep=False) as log:
        log.write("first\n")
        log.flush()
        with path.open("a") as other_file:
            other_file.write("other\n")
        log.write("second\n")

    assert path.read_text() == "first\nother\nsecond\n"


@pytest.fixture
def _limit_file_sizes():
    resource = pytest.importorskip("resource")
    soft_limit, hard_limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, hard_limit))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft_limit, hard_limit))


@pytest.mark.usefixtures("_limit_file_sizes")
def test_a_log_that_becomes_too_large_is_named(tmp_path):
    path = tmp_path / "log.jsonl"

    with (
        pytest.raises(OSError, match=r"log.jsonl") as error_info,
        open_log(path, keep=False) as log,
    ):
        log.write("new\n")
    assert error_info.value.filename == str(path)
