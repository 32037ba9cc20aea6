"""The Python programs in the guides run as written."""

import json

import numpy as np
import pytest

from quarc_ref.datasets.capture_notes import CaptureNotes
from quarc_ref.datasets.layouts.easymocap import read_easymocap
from quarc_ref.datasets.notes_file import read_capture_notes
from tests.datasets import scenes
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


def test_a_calibration_is_written_as_a_capture(tmp_path, monkeypatch):
    y_up = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # from the world of the shots, z up
    shots, dist = scenes.make_shots(), [-0.1, 0.02, 1 / 3e3, -1 / 7e3, 0.01, 0.1, 0.2, 0.3]
    (tmp_path / "studio" / "videos").mkdir(parents=True)
    calibration = {}
    for shot in shots:
        scenes.write_video(
            tmp_path / "studio" / "videos" / f"{shot.name}.mp4", [scenes.render(shot)]
        )
        matrix = [[shot.fx, 0, shot.cx - 0.5], [0, shot.fy, shot.cy - 0.5], [0, 0, 1]]
        rotation = (y_up @ shot.axes).T
        translation = -rotation @ y_up @ shot.center
        calibration[shot.name] = {
            "K": matrix, "dist": dist, "R": rotation.tolist(), "t": translation.tolist()
        }  # fmt: skip
    (tmp_path / "calibration.json").write_text(json.dumps(calibration))
    monkeypatch.chdir(tmp_path)

    run_example("captures.md")

    cameras = read_easymocap(tmp_path / "studio").cameras
    assert [camera.name for camera in cameras] == [shot.name for shot in shots]
    for camera, shot in zip(cameras, shots, strict=True):
        assert camera.lens.coefficients == tuple(dist)
        positions = np.array([[0.1, 0.2, 0.3], [-0.5, 0.1, 0.2]])
        projected = scenes.project(camera, positions @ y_up.T)
        assert projected == pytest.approx(shot.project(positions), abs=1e-9)
    notes = CaptureNotes(up=(0, 1, 0), meters_per_unit=1)
    assert read_capture_notes(tmp_path / "studio") == notes
