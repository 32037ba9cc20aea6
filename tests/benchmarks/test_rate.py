"""Tests the command `rate.py` on a small capture with existing streams."""

import json
import shutil
import sys

import pytest

from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.evaluation.same_capture import MismatchError
from rate import command, rows
from rate.converters import RoundTripScene
from tests.datasets import scenes
from tests.evaluation.capture_streams import write_stream

OUTPUT_NAMES = {"rate.csv", "claims.csv", "rate.md", "plane.coders.png"}


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rate") / "plane"
    return scenes.write_n3dv(folder, scenes.make_shots(), 4, scenes.make_plane_points())


@pytest.fixture
def stream_folder(capture, tmp_path, monkeypatch):
    """A folder with streams of both presets; npm is not on the PATH."""
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    data = write_stream(open_capture(capture).cameras, 4)
    for preset in ("main", "paper"):
        (tmp_path / f"plane.{preset}.quarc").write_bytes(data)
    return tmp_path


def _run_rate(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["rate.py", *map(str, arguments)])
    command.main()
    return capsys.readouterr().out


def test_everything_that_needs_no_npm_is_measured(capture, stream_folder, monkeypatch, capsys):
    options = ("--streams", stream_folder, "--preset", "main", "--json")
    report = json.loads(_run_rate(monkeypatch, capsys, capture, *options))

    rows_by_coder = {(row["preset"], row["coder"]): row for row in report["rows"]}
    for coder in ("the file", "zero-order estimate", "lzma-9e", "float32"):
        assert rows_by_coder["main", coder]["total"] > 0
    for coder in ("SPZ", "SOG"):
        assert rows_by_coder["main", coder]["remark"] == "unavailable: npm is not installed"
    size = (stream_folder / "plane.main.quarc").stat().st_size
    assert rows_by_coder["paper", "the file"]["total"] == size
    gain_claims = [
        claim for claim in report["claims"] if claim["claim"].startswith("PSNR minus the paper")
    ]
    assert [(claim["is"], claim["holds"]) for claim in gain_claims] == [(0, True)]
    assert report["machine"]["cores"] > 0
    assert {path.name for path in stream_folder.iterdir()} >= OUTPUT_NAMES


def test_frame_0_in_other_formats_is_compared_in_size_and_quality(
    capture, stream_folder, monkeypatch, capsys
):
    def convert_without_loss(splats, format_name, _folder):
        return RoundTripScene(5000, format_name.upper(), splats)

    monkeypatch.setattr(rows, "convert_and_restore", convert_without_loss)
    options = ("--streams", stream_folder, "--preset", "main", "--no-paper", "--json")
    report = json.loads(_run_rate(monkeypatch, capsys, capture, *options))

    rows_by_coder = {row["coder"]: row for row in report["rows"]}
    psnr = rows_by_coder["the file"]["psnr_first"]
    for coder in ("SPZ", "SOG"):
        row = rows_by_coder[coder]
        assert (row["canonical"], row["psnr_first"]) == (5000, pytest.approx(psnr))
        name = f"PSNR of frame 0 minus that of {coder}, dB"
        (gain,) = [claim["is"] for claim in report["claims"] if claim["claim"] == name]
        assert gain == pytest.approx(0, abs=1e-6)


def test_tables_and_csv_agree(capture, stream_folder, monkeypatch, capsys):
    options = ("--streams", stream_folder, "--preset", "main", "--no-paper")
    printed_text = _run_rate(monkeypatch, capsys, capture, *options)

    assert printed_text.strip() == (stream_folder / "rate.md").read_text().strip()
    assert "| plane | main | the file |" in printed_text
    assert "| plane | paper |" not in printed_text


def test_quality_of_the_same_bytes_is_measured_once(capture, stream_folder, monkeypatch, capsys):
    options = ("--streams", stream_folder, "--preset", "main", "--no-paper")
    first_output = _run_rate(monkeypatch, capsys, capture, *options)
    monkeypatch.setattr("rate.measure.evaluate_stream", None)

    assert _run_rate(monkeypatch, capsys, capture, *options) == first_output


def test_a_measured_stream_is_rejected_after_a_change_of_the_capture(
    capture, stream_folder, tmp_path_factory, monkeypatch, capsys
):
    changed_capture = shutil.copytree(capture, tmp_path_factory.mktemp("changed") / "plane")
    opened = open_capture(changed_capture)
    data = write_stream(opened.cameras, 4, {"fingerprint": opened.fingerprint})
    (stream_folder / "plane.main.quarc").write_bytes(data)
    options = ("--streams", stream_folder, "--preset", "main", "--no-paper")
    _run_rate(monkeypatch, capsys, changed_capture, *options)
    shutil.copy(changed_capture / "cam01.mp4", changed_capture / "cam00.mp4")

    with pytest.raises(MismatchError, match="made from another capture"):
        _run_rate(monkeypatch, capsys, changed_capture, *options)
