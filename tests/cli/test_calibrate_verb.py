"""Tests that `calibrate` passes on its options, whose effects tests/calibration/ tests."""

import shutil
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from quarc_ref.calibration import calibrate as calibrate_module
from quarc_ref.calibration.offsets import SyncMethod
from quarc_ref.calibration.world import Distance
from quarc_ref.cli.verbs.calibrate import _describe_offsets
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


@pytest.mark.parametrize(
    ("method", "frame_count", "text"),
    [
        (SyncMethod.SOUND, 10, "from sound"),
        (SyncMethod.MOTION, 24, "from motion"),
        (SyncMethod.NONE, 23, "not estimated; all are 0 (--sync motion needs 24 frames)"),
        (SyncMethod.NONE, 24, "not estimated; all are 0"),  # --sync none
    ],
)
def test_offsets_are_missing_for_the_reason_that_is_given(method, frame_count, text):
    calibration = SimpleNamespace(
        offsets=SimpleNamespace(method=method, sound_problem=""),
        recordings=SimpleNamespace(pictures=SimpleNamespace(lengths=(60, frame_count))),
    )

    assert _describe_offsets(calibration) == text

    calibration.offsets.sound_problem = "the sound of a.mp4 cannot be decoded"
    assert _describe_offsets(calibration) == f"{text}; the sound of a.mp4 cannot be decoded"
