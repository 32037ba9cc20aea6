import json
import shutil
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from quarc_ref.calibration import calibrate as calibrate_module
from quarc_ref.calibration.calibrate import CalibrateOptions, calibrate
from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.offsets import Offsets, SyncMethod
from quarc_ref.calibration.recordings import find_recordings
from quarc_ref.calibration.report import PAGE_NAME, make_camera_rows, write_report
from quarc_ref.calibration.write_capture import write_capture
from quarc_ref.datasets.calibration import make_pose
from quarc_ref.datasets.notes_file import read_capture_notes
from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.datasets.video_writer import VideoFormat, write_video_file
from quarc_ref.files import written_folder
from tests.calibration.rigs import measure_pose_errors
from tests.datasets.scenes import write_picture

GRAY = np.full((48, 64, 3), 128, np.uint8)
USED_CAMERAS = 5  # of the seven cameras of the rig
FEW_POINTS = 28  # points
NEIGHBORS = [f"cam{number:02}" for number in range(2, 7)]  # cam04 and four neighbors


def write_gray_video(path, pictures=(GRAY,)):
    with path.open("wb") as file:
        write_video_file(file, pictures, VideoFormat(64, 48, Fraction(30)))


def test_all_cameras_of_uncalibrated_videos_are_registered_with_their_true_poses(rig, traced_rig):
    rotation_error, position_error = measure_pose_errors(rig.world.cameras, traced_rig.cameras)

    assert rig.solution.left_out == {}
    assert rig.solution.mean_error < 0.7
    assert rotation_error < 0.5  # for pictures of 320 x 240; at 480 x 360 it is 0.1
    assert position_error < 0.01


def test_the_written_capture_opens_with_the_same_cameras(rig, tmp_path):
    with written_folder(tmp_path / "capture") as folder:
        write_capture(rig, folder)
    capture = open_capture(tmp_path / "capture")

    assert [camera.name for camera in capture.cameras] == [
        calibrated.name for calibrated in rig.world.cameras
    ]
    for camera, calibrated_camera in zip(capture.cameras, rig.world.cameras, strict=True):
        np.testing.assert_allclose(
            camera.rotation, calibrated_camera.pose.rotation.ravel(), atol=1e-9
        )
        np.testing.assert_allclose(
            camera.translation, calibrated_camera.pose.translation, atol=1e-9
        )
    assert len(capture.points.positions) == len(rig.points.positions) > 100
    notes = read_capture_notes(tmp_path / "capture")
    assert capture.notes == notes
    assert (notes.up, notes.meters_per_unit) == ((0, -1, 0), 1)


def test_the_capture_has_the_frame_rate_that_the_caller_states(rig, tmp_path):
    recordings = replace(rig.recordings, stated_frame_rate=25.0)
    with written_folder(tmp_path / "capture") as folder:
        write_capture(replace(rig, recordings=recordings), folder)

    assert rig.recordings.frames_per_second == 30
    capture = open_capture(tmp_path / "capture")
    assert (capture.frames_per_second, capture.findings) == (25, ())


def test_recordings_are_not_copied_into_the_capture(rig, traced_rig, tmp_path):
    with written_folder(tmp_path / "capture") as folder:
        write_capture(rig, folder)

    linked, original = tmp_path / "capture" / "cam00.mp4", traced_rig.folder / "cam00.mp4"
    assert linked.samefile(original)  # hard link: the folders of both are on the same disk
    document = json.loads((tmp_path / "capture" / "transforms.json").read_text())
    assert document["frames"][0]["file_path"] == "cam00.mp4"


def test_the_page_lists_every_camera_with_its_error(rig, tmp_path):
    with written_folder(tmp_path / "report") as folder:
        write_report(rig, "my <rig>", folder)
    page = (tmp_path / "report" / PAGE_NAME).read_text()

    assert "my &lt;rig&gt;: 7 of 7 cameras calibrated" in page
    for name, fit in rig.solution.fits.items():
        assert f"<td>{name}</td><td>{fit.mean_error:.2f}</td>" in page
    assert f"<td>{rig.world.cameras[0].name} and 6 more</td>" in page
    assert "All cameras were calibrated" in page
    assert "data:image/png;base64," in page


@pytest.mark.parametrize("offset", [-0.001, -0.0])
def test_no_offset_is_printed_or_written_as_minus_zero(rig, offset):
    offsets = Offsets(SyncMethod.SOUND, dict.fromkeys(rig.recordings.names, offset), {})

    assert {row[5] for row in make_camera_rows(replace(rig, offsets=offsets))} == {"+0.00"}
    assert {str(written) for written in offsets.written_offsets.values()} == {"0.0"}


def test_a_camera_that_sees_nothing_is_left_out_with_the_reason(traced_rig, tmp_path):
    for path in sorted(traced_rig.folder.iterdir())[:USED_CAMERAS]:
        (tmp_path / path.name).symlink_to(path)
    with (tmp_path / "gray.mp4").open("wb") as file:
        gray = np.full((240, 320, 3), 128, np.uint8)
        write_video_file(file, [gray], VideoFormat(320, 240, Fraction(30)))

    calibration = calibrate(
        find_recordings(tmp_path), CalibrateOptions(sync=SyncMethod.NONE, moment_count=1)
    )

    assert len(calibration.world.cameras) == USED_CAMERAS
    assert list(calibration.solution.left_out) == ["gray"]
    assert "only 0 features" in calibration.solution.left_out["gray"]


def test_recordings_without_content_are_rejected_with_advice(tmp_path):
    for name in "abc":
        write_gray_video(tmp_path / f"{name}.mp4")

    with pytest.raises(
        CalibrationError,
        match=r"fewer than three cameras could be calibrated.*a: its pictures have only",
    ):
        calibrate(find_recordings(tmp_path), CalibrateOptions(sync=SyncMethod.NONE))


def test_a_copy_of_another_recording_is_rejected_by_name(tmp_path, traced_rig):
    for path in sorted(traced_rig.folder.iterdir())[:3]:
        (tmp_path / path.name).write_bytes(path.read_bytes())
    shutil.copy(tmp_path / "cam01.mp4", tmp_path / "cam08.mp4")

    with pytest.raises(CalibrationError, match="cam01 and cam08 show the same picture"):
        calibrate(find_recordings(tmp_path), CalibrateOptions(sync=SyncMethod.NONE))


def test_two_cameras_are_too_few(tmp_path):
    for name in "ab":
        write_gray_video(tmp_path / f"{name}.mp4")

    with pytest.raises(CalibrationError, match="recordings of 2 cameras, but at least 3"):
        find_recordings(tmp_path)


@pytest.mark.parametrize("pattern", ["{name}.mp4", "videos/{name}.mp4"])
def test_videos_that_cannot_be_used_are_left_out_with_the_reason(tmp_path, pattern):
    folder = (tmp_path / pattern).parent
    folder.mkdir(exist_ok=True)
    for name in "abc":
        write_gray_video(tmp_path / pattern.format(name=name))
    for name in ("a.avi", "d.avi", "notes.txt", ".e.avi"):
        (folder / name).write_bytes(b"")
    (folder / "f.mp4").symlink_to(folder / "missing.mp4")
    (folder / "masks").mkdir()

    left_out = find_recordings(tmp_path).left_out
    assert list(left_out) == ["d", "f"]
    assert left_out["d"].startswith("d.avi cannot be read: convert")
    assert left_out["f"] == "f.mp4 is a broken link"


def test_folders_that_cannot_be_used_are_left_out_with_the_reason(tmp_path):
    for name in "abc":
        write_picture(tmp_path / name / "0000.png", GRAY)
    for name in ("d", "masks", ".hidden"):
        (tmp_path / name).mkdir()
    (tmp_path / "e").symlink_to(tmp_path / "missing")
    write_gray_video(tmp_path / "f.mp4")

    assert find_recordings(tmp_path).left_out == {
        "d": "d has no PNG or JPEG pictures",
        "e": "e is a broken link",
        "f": "f.mp4 is a video, but the other recordings are pictures",
    }


def test_the_page_counts_and_names_recordings_that_were_left_out(rig, tmp_path):
    recordings = replace(rig.recordings, left_out={"cam09": "cam09 has no <pictures>"})
    with written_folder(tmp_path / "report") as folder:
        write_report(replace(rig, recordings=recordings), "rig", folder)
    page = (tmp_path / "report" / PAGE_NAME).read_text()

    assert "rig: 7 of 8 cameras calibrated" in page
    assert "<li><b>cam09</b>: cam09 has no &lt;pictures&gt;</li>" in page


def test_names_are_made_safe_and_keep_their_order(tmp_path):
    for name in ("GOPR 2 (left).MP4", "GOPR 10.mov", "GOPR 1.mp4"):
        write_gray_video(tmp_path / name)

    assert find_recordings(tmp_path).names == ("GOPR_1", "GOPR_2_left_", "GOPR_10")


def test_names_that_would_collide_are_rejected(tmp_path):
    for name in ("a b.mp4", "a+b.mp4", "c.mp4"):
        write_gray_video(tmp_path / name)

    with pytest.raises(CalibrationError, match="would both be named a_b: rename one"):
        find_recordings(tmp_path)


def _rotate_camera(camera, degrees=20):
    """Return a camera rotated about its vertical axis, at the same position."""
    angle = np.radians(degrees)
    cosine, sine = np.cos(angle), np.sin(angle)
    rotation = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    center = -camera.pose.rotation.T @ camera.pose.translation
    return replace(camera, pose=make_pose(camera.pose.rotation.T @ rotation, center))


@pytest.mark.parametrize("degrees", [pytest.param(0, marks=pytest.mark.thorough), 20])
def test_a_camera_with_few_points_is_left_out_if_its_picture_contradicts_its_pose(
    rig, traced_rig, tmp_path, monkeypatch, degrees
):
    solution, name = rig.solution, "cam04"
    for neighbor in NEIGHBORS:
        (tmp_path / f"{neighbor}.mp4").symlink_to(traced_rig.folder / f"{neighbor}.mp4")
    changed_solution = replace(
        solution,
        cameras=tuple(
            _rotate_camera(camera, degrees) if camera.name == name else camera
            for camera in solution.cameras
            if camera.name in NEIGHBORS
        ),
        fits={neighbor: solution.fits[neighbor] for neighbor in NEIGHBORS}
        | {name: replace(solution.fits[name], support=FEW_POINTS)},
    )
    monkeypatch.setattr(calibrate_module, "_estimate_poses", lambda *_: (changed_solution, 1))
    calibration = calibrate(find_recordings(tmp_path), CalibrateOptions(sync=SyncMethod.NONE))

    if degrees:
        assert list(calibration.solution.left_out) == [name]
        assert f"see {FEW_POINTS} of its points" in calibration.solution.left_out[name]
        assert len(calibration.world.cameras) == len(NEIGHBORS) - 1
    else:
        assert calibration.solution.left_out == {}
        assert calibration.unreliable_cameras == (name,)
