"""Outputs that are closed, full, or go away, as a process of its own meets them."""

import os
import subprocess

import pytest

from tests.cli.processes import COMMAND

# Python looks at what it has not yet written when it ends; unbuffered, there is nothing.
_BUFFERED = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}


def _run(redirection, *arguments):
    """A command line with its outputs redirected as a shell does it; exit code and what it said."""
    command = ["sh", "-c", f'"$@" {redirection}', "sh", *COMMAND, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, env=_BUFFERED, timeout=60, check=False)
    return done.returncode, done.stderr.decode()


@pytest.mark.parametrize(
    ("redirection", "code", "said"),
    [
        (">&-", 0, ""),
        ("2>&-", 0, ""),
        (">/dev/full", 3, "quarc-ref: No space left on device\n"),
        (">/dev/full 2>/dev/full", 3, ""),
    ],
)
def test_a_stream_is_verified_whatever_becomes_of_what_is_said(
    redirection, code, said, stream_file
):
    assert _run(redirection, "verify", stream_file, "--json", "-q") == (code, said)


def test_a_bad_stream_stays_bad_where_nothing_can_be_said(stream_file):
    stream_file.write_bytes(stream_file.read_bytes()[:-1])

    code, said = _run(">/dev/full", "verify", stream_file, "--json", "-q")
    assert code == 1
    assert "truncated" in said
    assert _run(">&- 2>&-", "verify", stream_file)[0] == 1
