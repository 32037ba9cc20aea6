"""Tests of standard output and error that are closed or full, in separate processes."""

import os
import signal
import subprocess

import pytest

from tests.cli.processes import COMMAND

# Python flushes its buffers when it ends; unbuffered output has nothing to flush.
_BUFFERED_ENVIRONMENT = {
    name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"
}


def _run_redirected(redirection, *arguments):
    """Run a command line with shell redirections; return the exit code and standard error."""
    command = ["sh", "-c", f'"$@" {redirection}', "sh", *COMMAND, *map(str, arguments)]
    completed = subprocess.run(
        command, capture_output=True, env=_BUFFERED_ENVIRONMENT, timeout=60, check=False
    )
    return completed.returncode, completed.stderr.decode()


@pytest.mark.parametrize(
    ("redirection", "code", "message"),
    [
        (">&-", 0, ""),
        ("2>&-", 0, ""),
        (">/dev/full", 3, "quarc-ref: No space left on device\n"),
        (">/dev/full 2>/dev/full", 3, ""),
    ],
)
def test_a_stream_is_verified_even_if_standard_output_fails(
    redirection, code, message, stream_file
):
    assert _run_redirected(redirection, "verify", stream_file, "--json", "-q") == (code, message)


def test_a_stream_is_not_written_to_a_closed_standard_output(stream_file):
    code, message = _run_redirected(">&-", "cut", stream_file, "--frames", ":", "-o", "-")

    assert code == 2
    assert message.startswith("quarc-ref: standard output is closed")


@pytest.mark.parametrize(
    "environment", [_BUFFERED_ENVIRONMENT, _BUFFERED_ENVIRONMENT | {"PYTHONUNBUFFERED": "1"}]
)
@pytest.mark.parametrize(
    "arguments", [["inspect"], ["info", "--json"], ["cut", "--frames", ":", "-o", "-"]]
)
def test_a_closed_pipe_ends_a_verb_with_the_exit_code_of_sigpipe(
    arguments, environment, stream_file
):
    read_end, write_end = os.pipe()
    os.close(read_end)
    with os.fdopen(write_end, "wb") as pipe:
        command = [*COMMAND, arguments[0], str(stream_file), *arguments[1:]]
        completed = subprocess.run(
            command, stdout=pipe, stderr=subprocess.PIPE, env=environment, timeout=60, check=False
        )

    assert (completed.returncode, completed.stderr) == (128 + signal.SIGPIPE, b"")


@pytest.mark.parametrize("arguments", [["--help"], ["info", "--help"], ["--version"]])
def test_a_closed_pipe_ends_help_with_the_exit_code_of_sigpipe(arguments):
    read_end, write_end = os.pipe()
    os.close(read_end)
    with os.fdopen(write_end, "wb") as pipe:
        completed = subprocess.run(
            [*COMMAND, *arguments], stdout=pipe, stderr=subprocess.PIPE, timeout=60, check=False
        )

    assert (completed.returncode, completed.stderr) == (128 + signal.SIGPIPE, b"")


@pytest.mark.parametrize("arguments", [[], ["--help"], ["info", "--help"], ["--version"]])
def test_help_that_cannot_be_written_ends_with_the_exit_code_of_a_failure(arguments):
    code, message = _run_redirected(">/dev/full", *arguments)

    assert (code, message) == (3, "quarc-ref: No space left on device\n")


def test_a_usage_error_that_cannot_be_written_ends_with_the_exit_code_of_a_failure():
    assert _run_redirected("2>/dev/full", "info", "missing.quarc") == (3, "")


def test_standard_error_can_be_a_closed_pipe(stream_file):
    stream_file.write_bytes(stream_file.read_bytes()[:-1])
    read_end, write_end = os.pipe()
    os.close(read_end)
    with os.fdopen(write_end, "wb") as pipe:
        command = [*COMMAND, "verify", str(stream_file)]
        completed = subprocess.run(
            command, stderr=pipe, env=_BUFFERED_ENVIRONMENT, timeout=60, check=False
        )

    assert completed.returncode == 1


def test_a_bad_stream_is_reported_even_if_all_output_fails(stream_file):
    stream_file.write_bytes(stream_file.read_bytes()[:-1])

    code, message = _run_redirected(">/dev/full", "verify", stream_file, "--json", "-q")
    assert code == 1
    assert "truncated" in message
    assert _run_redirected(">&- 2>&-", "verify", stream_file)[0] == 1


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_text_that_the_encoding_of_the_output_lacks_is_escaped(encoding, stream_file, tmp_path):
    """On Windows, standard output of a command that is redirected to a file is not UTF-8."""
    path = stream_file.rename(tmp_path / "\u6620.quarc")
    completed = subprocess.run(
        [*COMMAND, "info", path],
        capture_output=True,
        env=_BUFFERED_ENVIRONMENT | {"PYTHONIOENCODING": encoding},
        timeout=60,
        check=False,
    )

    assert (completed.returncode, completed.stderr) == (0, b"")
    title = "\u6620" if encoding == "utf-8" else "\\u6620"
    assert completed.stdout.decode(encoding).startswith(f"{title}.quarc")
