"""The Python programs in the guides run as written."""

import pytest

from tests.docs.pages import GUIDES, find_fences
from tests.small_streams import make_stream


def run_example(page: str) -> None:
    (program,) = find_fences(GUIDES / page, "python")
    exec(compile(program, page, "exec"), {"__name__": "__main__"})


@pytest.mark.parametrize(("removed_bytes", "last_line"), [(0, "3 ("), (1, "rejected: ")])
def test_frames_are_decoded_or_the_stream_is_rejected(
    removed_bytes, last_line, tmp_path, monkeypatch, capsys
):
    data, states = make_stream()
    (tmp_path / "steak.quarc").write_bytes(data[: len(data) - removed_bytes])
    monkeypatch.chdir(tmp_path)

    run_example("python.md")

    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(states) + (removed_bytes > 0)
    assert lines[-1].startswith(last_line)


def test_arrays_are_encoded(capsys):
    run_example("exchange.md")

    assert capsys.readouterr().out.startswith("Errors(position=")
