import io
import logging
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.cli import output
from quarc_ref.cli.output import (
    MessageHandler,
    TerminalProgress,
    escape_controls,
    print_columns,
    print_fields,
    print_json,
)


@pytest.fixture
def clock(monkeypatch):
    """A list whose only element is the time in seconds that the progress display reads."""
    seconds = [100.0]
    monkeypatch.setattr(output.time, "monotonic", lambda: seconds[0])
    return seconds


def test_json_has_only_numbers_that_json_allows(capsys):
    with pytest.raises(ValueError, match="not JSON compliant"):
        print_json("eval/1", {"psnr": math.inf})

    assert capsys.readouterr().out == ""


def test_a_logged_message_is_printed_only_once(capsys):
    handler = MessageHandler()
    for message in ("first", "second", "first"):
        handler.handle(logging.makeLogRecord({"msg": message}))

    assert capsys.readouterr().err == "quarc-ref: first\nquarc-ref: second\n"


def test_a_table_wraps_long_values_and_loses_no_letter(capsys):
    digest = "0123456789" * 20
    print_fields("title", {"name": digest})

    printed_text = capsys.readouterr().out
    assert printed_text.split()[:2] == ["title", "name"]
    assert "".join(printed_text.split()[2:]) == digest


@pytest.mark.parametrize("columns", [1, 10, 30])
def test_a_table_is_complete_on_a_narrow_terminal(columns, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", str(columns))
    print_fields("title", {"whole stream": "1,626 bytes"})

    assert capsys.readouterr().out.split() == ["title", "whole", "stream", "1,626", "bytes"]


def test_a_long_title_is_not_wrapped(capsys):
    print_fields("a-very-long-name.quarc" * 9, {"name": "1"})

    assert capsys.readouterr().out.split() == ["a-very-long-name.quarc" * 9, "name", "1"]


@given(st.text())
def test_escaped_text_is_one_printable_line(text):
    assert escape_controls(text).isprintable()


@given(st.text().filter(str.isprintable))
def test_text_without_control_characters_is_unchanged(text):
    assert escape_controls(text) == text


def test_tables_and_announcements_have_no_control_characters(monkeypatch, capsys):
    name = "a\x1b]0;title\x07\n"
    print_fields(name, {name: name})
    print_columns(name, [f"<{name}", name], [[name, name]])
    with TerminalProgress(quiet=False) as progress:
        progress.announce(name)
    monkeypatch.setenv("FORCE_COLOR", "1")
    with TerminalProgress(quiet=False) as progress:
        progress.announce(name)

    captured = capsys.readouterr()
    assert "]0;title" not in (captured.out + captured.err).replace(r"a\x1b]0;title\x07\n", "")


def test_short_work_writes_no_progress_line(clock, capsys):
    with TerminalProgress(quiet=False) as progress:
        for frame_count in range(1, 5):
            clock[0] += 1
            progress.advance("frames", frame_count, 4)

    assert capsys.readouterr().err == ""


def test_long_work_writes_a_line_now_and_then_and_one_at_the_end(clock, capsys):
    with TerminalProgress(quiet=False) as progress:
        for frame_count in range(1, 13):
            clock[0] += 2
            progress.advance("frames", frame_count, 12)
            progress.advance("motion", 100, 100)

    captured = capsys.readouterr()
    assert captured.err.splitlines() == [
        "frames 3/12",
        "frames 6/12",
        "frames 9/12",
        "frames 12/12",
    ]
    assert captured.out == ""


def test_quiet_work_writes_nothing_even_if_long(clock, capsys):
    with TerminalProgress(quiet=True) as progress:
        clock[0] += 100
        progress.advance("frames", 1, 2)

    assert capsys.readouterr().err == ""


def test_work_goes_on_if_nobody_reads_the_progress(clock, monkeypatch):
    class ClosedPipe(io.StringIO):
        def write(self, _text):
            raise BrokenPipeError

    monkeypatch.setattr("sys.stderr", ClosedPipe())
    with TerminalProgress(quiet=False) as progress:
        for done in range(1, 4):
            clock[0] += 100
            progress.advance("decode", done, 3)


def test_a_terminal_shows_bars_on_stderr(monkeypatch, capsys):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    with TerminalProgress(quiet=False) as progress:
        progress.advance("frames", 1, 2)
        progress.advance("frames", 2, 2)

    captured = capsys.readouterr()
    assert captured.out == ""
    assert "2/2" in captured.err
