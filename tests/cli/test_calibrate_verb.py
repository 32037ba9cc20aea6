"""Tests that `calibrate` passes on its options, whose effects tests/calibration/ tests."""

import shutil

import cv2
import numpy as np

from quarc_ref.calibration import calibrate as calibrate_module
from quarc_ref.calibration.offsets import SyncMethod
from quarc_ref.calibration.world import Distance
from tests.cli.commands import list_names, run


def test_every_option_reaches_the_calibration(capture, tmp_path, monkeypatch):
    calls = []

    def calibrate(recordings, options):
        calls.append((recordings, options))
        raise KeyboardInterrupt

    for folder in ("videos", "masks"):
        (tmp_path / folder).mkdir()
    for video in capture.glob("*.mp4"):
        shutil.copy(video, tmp_path / "videos")
    (tmp_path / "videos" / "left.avi").write_bytes(b"")
    assert cv2.imwrite(str(tmp_path / "masks" / "cam01.png"), np.full((32, 48), 255, np.uint8))
    monkeypatch.setattr(calibrate_module, "calibrate", calibrate)
    result = run(
        "calibrate", tmp_path / "videos", "-o", tmp_path / "out", "--camera-model", "OPENCV",
        "--lenses", "each", "--intrinsics", capture, "--mask", tmp_path / "masks", "--moments", 3,
        "--sync", "motion", "--fps", 24, "--up", "cam01", "--meters", "cam00", "cam03", 2.5,
    )  # fmt: skip

    ((recordings, options),) = calls
    assert (result.exit_code, list_names(tmp_path)) == (130, ["masks", "videos"])
    assert "camera left is left out: left.avi cannot be read" in result.stderr
    assert recordings.frames_per_second == 24
    assert (options.lenses.model, options.lenses.is_shared) == ("OPENCV", False)
    assert list(options.lenses.known_lenses) == list(recordings.names)
    assert list(options.masks) == ["cam01"]
    assert (options.moment_count, options.sync, options.up) == (3, SyncMethod.MOTION, "cam01")
    assert options.distance == Distance("cam00", "cam03", 2.5)
