"""The whole command on a small capture with an existing stream."""

import json
import sys

import pytest

from quarc_ref.datasets.open_capture import open_capture
from rate import command
from tests.datasets import scenes
from tests.evaluation.capture_streams import write_stream

FILES = {"rate.csv", "claims.csv", "rate.md", "plane.coders.png"}


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rate") / "plane"
    return scenes.write_n3dv(folder, scenes.make_shots(), 4, scenes.make_plane_points())


@pytest.fixture
def streams(capture, tmp_path, monkeypatch):
    """A folder with both streams, on a machine without npm."""
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    data = write_stream(open_capture(capture).cameras, 4)
    for preset in ("main", "paper"):
        (tmp_path / f"plane.{preset}.quarc").write_bytes(data)
    return tmp_path


def _run(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["rate.py", *map(str, arguments)])
    command.main()
    return capsys.readouterr().out


def test_everything_that_needs_no_npm_is_measured(capture, streams, monkeypatch, capsys):
    options = ("--streams", streams, "--preset", "main", "--json")
    reported = json.loads(_run(monkeypatch, capsys, capture, *options))

    rows = {(row["preset"], row["coder"]): row for row in reported["rows"]}
    for coder in ("the file", "zero-order estimate", "lzma-9e", "float32"):
        assert rows["main", coder]["total"] > 0
    for coder in ("SPZ", "SOG"):
        assert rows["main", coder]["remark"] == "unavailable: npm is not installed"
    size = (streams / "plane.main.quarc").stat().st_size
    assert rows["paper", "the file"]["total"] == size
    gain = [
        claim for claim in reported["claims"] if claim["claim"].startswith("PSNR less the paper")
    ]
    assert [(claim["is"], claim["holds"]) for claim in gain] == [(0, True)]
    assert reported["machine"]["cores"] > 0
    assert {path.name for path in streams.iterdir()} >= FILES


def test_tables_and_csv_agree(capture, streams, monkeypatch, capsys):
    options = ("--streams", streams, "--preset", "main", "--no-paper")
    reported = _run(monkeypatch, capsys, capture, *options)

    assert reported.strip() == (streams / "rate.md").read_text().strip()
    assert "| plane | main | the file |" in reported
    assert "| plane | paper |" not in reported


def test_quality_of_the_same_bytes_is_measured_once(capture, streams, monkeypatch, capsys):
    options = ("--streams", streams, "--preset", "main", "--no-paper")
    first = _run(monkeypatch, capsys, capture, *options)
    monkeypatch.setattr("rate.measure.evaluate_stream", None)

    assert _run(monkeypatch, capsys, capture, *options) == first
