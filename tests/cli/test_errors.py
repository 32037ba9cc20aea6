import errno
import os
import select
import sys
from contextlib import contextmanager

import pytest
import typer

from quarc_ref.cli.errors import UsageError, report_errors, report_failed_output
from quarc_ref.cli.signals import Termination
from quarc_ref.datasets.errors import TruncatedVideoError
from quarc_ref.format.errors import (
    ClosedLoopError,
    EditError,
    EncodeError,
    EnvironmentVariableError,
    HeaderCrcError,
    SourceError,
    StateCrcError,
    VerificationError,
)


def _get_exit_code(error):
    """Return the exit code for an error."""
    with pytest.raises(typer.Exit) as exit_info, report_errors():
        raise error
    return exit_info.value.exit_code


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (HeaderCrcError("damaged", 8), 1, "rejected: header-crc at byte 8: damaged"),
        (StateCrcError("another"), 1, "rejected: state-crc: another"),
        (UsageError("no such range"), 2, "no such range"),
        (TruncatedVideoError("cam01.mp4 ends early"), 3, "cam01.mp4 ends early"),
        (EncodeError("too many"), 3, "too many"),
        (ClosedLoopError("differs"), 3, "differs"),
        (OSError(errno.ENOSPC, "No space left on device", "/x"), 3, "/x: No space left on device"),
        (FileNotFoundError(errno.ENOENT, "No such file", "/y"), 3, "/y: No such file"),
        (OSError("no encoder"), 3, "no encoder"),
        (RuntimeError("CUDA out of memory"), 3, "CUDA out of memory"),
        (RuntimeError(), 3, "RuntimeError()"),
        (ModuleNotFoundError("No module", name="torch"), 3, 'pip install ".[encode]"'),
        (ModuleNotFoundError("No module", name="gsplat"), 3, 'pip install ".[gpu]"'),
        (KeyboardInterrupt(), 130, "interrupted; nothing new was written"),
        (KeyboardInterrupt("interrupted; the file holds"), 130, "interrupted; the file holds"),
        (Termination(), 143, "interrupted; nothing new was written"),
        (BrokenPipeError(errno.EPIPE, "Broken pipe"), 3, "Broken pipe"),
        (MemoryError("Unable to allocate 2 TiB"), 3, "not enough memory: Unable to allocate"),
        (MemoryError(), 3, "out of memory"),
        (EditError("frame 3 is not a keyframe"), 2, "frame 3 is not a keyframe"),
        (EnvironmentVariableError("no such kernels"), 2, "no such kernels"),
        (UnicodeEncodeError("utf-8", "a\udcff", 1, 2, "why"), 3, "is not valid UTF-8"),
        (SourceError("the server is silent"), 3, "the server is silent"),
        (VerificationError("two results"), 3, "two results"),
    ],
)
def test_an_error_becomes_one_line_and_its_exit_code(error, code, message, capsys):
    assert _get_exit_code(error) == code

    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("quarc-ref: ")
    assert message in captured.err


class _PollOfMacOS:
    """Polls like macOS, which says nothing about a file unless it waits for an event of it."""

    def __init__(self, poll):
        self._poll = poll

    def register(self, file, events):
        if events:
            self._poll.register(file, events)

    def poll(self, timeout):
        return self._poll.poll(timeout)


@contextmanager
def _write_to_closed_pipe(monkeypatch):
    """Make standard output a pipe that nobody reads."""
    read_end, write_end = os.pipe()
    os.close(read_end)
    with os.fdopen(write_end, "w") as pipe:
        monkeypatch.setattr(sys, "stdout", pipe)
        yield


def test_a_closed_pipe_is_recognized_on_macos(monkeypatch, capsys):
    poll = select.poll()
    monkeypatch.setattr(select, "poll", lambda: _PollOfMacOS(poll))
    with _write_to_closed_pipe(monkeypatch):
        assert _get_exit_code(BrokenPipeError(errno.EPIPE, "Broken pipe")) == 141

    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("context", [report_errors, report_failed_output])
def test_a_closed_pipe_is_recognized_on_windows(context, monkeypatch, capsys):
    monkeypatch.setattr(sys, "platform", "win32")
    with (
        _write_to_closed_pipe(monkeypatch),
        pytest.raises((typer.Exit, SystemExit)) as exit_info,
        context(),
    ):
        raise OSError(errno.EINVAL, "Invalid argument")

    code = "exit_code" if isinstance(exit_info.value, typer.Exit) else "code"
    assert getattr(exit_info.value, code) == 141
    assert capsys.readouterr().err == ""


def test_an_invalid_argument_is_an_error_on_windows_if_the_output_is_no_pipe(tmp_path, monkeypatch):
    with (tmp_path / "output").open("w") as file:
        monkeypatch.setattr(sys, "stdout", file)
        monkeypatch.setattr(sys, "stderr", file)
        monkeypatch.setattr(sys, "platform", "win32")

        assert _get_exit_code(OSError(errno.EINVAL, "Invalid argument")) == 3


def test_an_interruption_says_what_is_kept_and_ends_with_the_code_of_its_signal():
    interruption = KeyboardInterrupt("interrupted; the file holds")
    interruption.__cause__ = Termination()

    assert _get_exit_code(interruption) == 143


def test_an_internal_error_shows_its_location_and_does_not_blame_the_stream(capsys):
    assert _get_exit_code(ZeroDivisionError("oops")) == 3

    messages = capsys.readouterr().err
    assert "Traceback" in messages
    assert messages.splitlines()[-1] == "quarc-ref: internal error: ZeroDivisionError('oops')"


def test_a_message_cannot_control_the_terminal(capsys):
    _get_exit_code(UsageError("name \x1b[2J\nsecond"))

    assert capsys.readouterr().err == "quarc-ref: name \\x1b[2J\\nsecond\n"


def test_success_is_not_changed():
    with report_errors():
        value = 3

    assert value == 3
