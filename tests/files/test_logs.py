"""Tests of log files: kept lines, unfinished lines, and empty files."""

from contextlib import suppress

import pytest

from quarc_ref.files import open_log


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
