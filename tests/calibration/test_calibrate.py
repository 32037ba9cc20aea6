import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from quarc_ref.calibration import calibrate as module
from quarc_ref.calibration.calibrate import CalibrateOptions, calibrate
from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.offsets import SyncMethod
from quarc_ref.calibration.recordings import find_recordings
from quarc_ref.calibration.report import PAGE, write_report
from quarc_ref.calibration.write_capture import write_capture
from quarc_ref.datasets.calibration import make_pose
from quarc_ref.datasets.capture_notes import read_capture_notes
from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.datasets.video_writer import VideoFormat, write_video_file
from quarc_ref.files import written_folder
from tests.calibration.rigs import compare

FLAT = np.full((48, 64, 3), 128, np.uint8)
SOME = 6  # of the 13 cameras of the rig
FEW = 28  # points
NEAR = [f"cam{number:02}" for number in range(5, 10)]  # cam07 and its neighbors


def write_flat(path, pictures=(FLAT,)):
    with path.open("wb") as file:
        write_video_file(file, pictures, VideoFormat(64, 48, Fraction(30)))


def test_all_cameras_of_uncalibrated_videos_are_registered_with_their_true_poses(rig, traced):
    angle, place = compare(rig.world.cameras, traced.true)

    assert rig.solution.left_out == {}
    assert rig.solution.mean_error < 0.7
    assert angle < 0.5  # for pictures of 320 x 240; at 480 x 360 it is 0.1
    assert place < 0.01


def test_the_written_capture_opens_with_the_same_cameras(rig, tmp_path):
    with written_folder(tmp_path / "capture") as folder:
        write_capture(rig, folder)
    capture = open_capture(tmp_path / "capture")

    assert [camera.name for camera in capture.cameras] == [each.name for each in rig.world.cameras]
    for camera, found in zip(capture.cameras, rig.world.cameras, strict=True):
        np.testing.assert_allclose(camera.rotation, found.pose.rotation.ravel(), atol=1e-9)
        np.testing.assert_allclose(camera.translation, found.pose.translation, atol=1e-9)
    assert len(capture.points.positions) == len(rig.points.positions) > 100
    notes = read_capture_notes(tmp_path / "capture")
    assert capture.notes == notes
    assert (notes.up, notes.meters_per_unit) == ((0, -1, 0), 1)


def test_recordings_are_not_copied_into_the_capture(rig, traced, tmp_path):
    with written_folder(tmp_path / "capture") as folder:
        write_capture(rig, folder)

    inside, recorded = tmp_path / "capture" / "cam00.mp4", traced.folder / "cam00.mp4"
    assert inside.samefile(recorded)  # both are in pytest's folder, on the same disk
    document = json.loads((tmp_path / "capture" / "transforms.json").read_text())
    assert document["frames"][0]["file_path"] == "cam00.mp4"


def test_the_page_lists_every_camera_with_its_error(rig, tmp_path):
    with written_folder(tmp_path / "report") as folder:
        write_report(rig, "my <rig>", folder)
    page = (tmp_path / "report" / PAGE).read_text()

    assert "my &lt;rig&gt;: 13 of 13 cameras calibrated" in page
    for name, fit in rig.solution.fits.items():
        assert f"<td>{name}</td><td>{fit.mean_error:.2f}</td>" in page
    assert "All cameras were calibrated" in page
    assert "data:image/png;base64," in page


def test_a_camera_that_sees_nothing_is_left_out_with_the_reason(traced, tmp_path):
    for path in sorted(traced.folder.iterdir())[:SOME]:
        (tmp_path / path.name).symlink_to(path)
    with (tmp_path / "gray.mp4").open("wb") as file:
        gray = np.full((240, 320, 3), 128, np.uint8)
        write_video_file(file, [gray], VideoFormat(320, 240, Fraction(30)))

    found = calibrate(find_recordings(tmp_path), CalibrateOptions(sync=SyncMethod.NONE, moments=1))

    assert len(found.world.cameras) == SOME
    assert list(found.solution.left_out) == ["gray"]
    assert "only 0 features" in found.solution.left_out["gray"]


def test_recordings_without_content_are_rejected_with_advice(tmp_path):
    for name in "abc":
        write_flat(tmp_path / f"{name}.mp4")

    with pytest.raises(
        CalibrationError,
        match=r"fewer than three cameras could be calibrated.*a: its pictures have only",
    ):
        calibrate(find_recordings(tmp_path), CalibrateOptions(sync=SyncMethod.NONE))


def test_two_cameras_are_too_few(tmp_path):
    for name in "ab":
        write_flat(tmp_path / f"{name}.mp4")

    with pytest.raises(CalibrationError, match="recordings of 2 cameras, but at least 3"):
        find_recordings(tmp_path)


def test_names_are_made_safe_and_keep_their_order(tmp_path):
    for name in ("GOPR 2 (left).MP4", "GOPR 10.mov", "GOPR 1.mp4"):
        write_flat(tmp_path / name)

    assert find_recordings(tmp_path).names == ("GOPR_1", "GOPR_2_left_", "GOPR_10")


def test_names_that_would_collide_are_rejected(tmp_path):
    for name in ("a b.mp4", "a+b.mp4", "c.mp4"):
        write_flat(tmp_path / name)

    with pytest.raises(CalibrationError, match="would both be named a_b: rename one"):
        find_recordings(tmp_path)


def _turn(camera, degrees=20):
    """A camera rotated to its side at its position."""
    angle = np.radians(degrees)
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    center = -camera.pose.rotation.T @ camera.pose.translation
    return replace(camera, pose=make_pose(camera.pose.rotation.T @ turn, center))


@pytest.mark.parametrize("degrees", [0, 20])
def test_a_camera_with_few_points_is_left_out_if_its_picture_contradicts_its_pose(
    rig, traced, tmp_path, monkeypatch, degrees
):
    solution, name = rig.solution, "cam07"
    for near in NEAR:
        (tmp_path / f"{near}.mp4").symlink_to(traced.folder / f"{near}.mp4")
    planted = replace(
        solution,
        cameras=tuple(
            _turn(camera, degrees) if camera.name == name else camera
            for camera in solution.cameras
            if camera.name in NEAR
        ),
        fits={near: solution.fits[near] for near in NEAR}
        | {name: replace(solution.fits[name], support=FEW)},
    )
    monkeypatch.setattr(module, "_solve", lambda *_: (planted, 1))
    found = calibrate(find_recordings(tmp_path), CalibrateOptions(sync=SyncMethod.NONE))

    if degrees:
        assert list(found.solution.left_out) == [name]
        assert f"{FEW} of its points" in found.solution.left_out[name]
        assert len(found.world.cameras) == len(NEAR) - 1
    else:
        assert found.solution.left_out == {}
        assert found.unreliable == (name,)
