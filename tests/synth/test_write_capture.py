from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.datasets.points_ply import read_points_ply
from quarc_ref.datasets.video import VideoReader
from quarc_ref.files import MARKER_NAME
from quarc_ref.synth import write_capture
from quarc_ref.synth.options import SynthOptions
from quarc_ref.synth.rig import place_cameras
from quarc_ref.synth.write_capture import write_synthetic_capture

_VIDEOS = ["cam00.mp4", "cam01.mp4", "cam02.mp4", "cam03.mp4", "cam04.mp4"]


def test_a_capture_has_a_video_for_each_camera_and_poses_and_points(folder):
    names = sorted(path.name for path in folder.iterdir())

    assert names == [MARKER_NAME, *_VIDEOS, "points3D_init.ply", "poses_bounds.npy"]


def test_every_video_has_the_requested_size_rate_and_frames(folder, options):
    readers = [VideoReader(folder / name) for name in _VIDEOS]

    assert {(reader.width, reader.height) for reader in readers} == {
        (options.width, options.height)
    }
    assert {reader.frames_per_second for reader in readers} == {30.0}
    assert {reader.frame_count for reader in readers} == {options.frames}


def test_poses_have_a_row_of_seventeen_for_each_camera(folder):
    poses = np.load(folder / "poses_bounds.npy")

    assert poses.shape == (5, 17)
    assert poses.dtype == np.float64


def test_the_bounds_of_a_pose_contain_everything_its_camera_sees(folder):
    poses = np.load(folder / "poses_bounds.npy")

    assert (poses[:, 15] > 1).all()
    assert (poses[:, 15] < poses[:, 16]).all()
    assert (poses[:, 16] < 10).all()


def test_points_are_about_eight_thousand_within_the_room(folder):
    points = read_points_ply(folder / "points3D_init.ply")

    assert len(points.positions) == 8000
    assert np.abs(points.positions).max() < 4.05


def test_the_loader_opens_the_capture_with_the_first_camera_held_out(folder, options):
    capture = open_capture(folder)

    assert capture.held_out == (0,)
    assert capture.frame_count == options.frames
    assert capture.image(2, 1).shape == (options.height, options.width, 3)


def test_points_have_the_colors_seen_by_other_cameras(folder, options):
    points = read_points_ply(folder / "points3D_init.ply")
    matches = []
    for index, camera in enumerate(place_cameras(options)):
        picture = VideoReader(folder / f"cam{index:02}.mp4").read(0)
        x, y, depth = camera.axes @ (points.positions - camera.center).T
        column = np.floor(camera.focal_length * x / depth + options.width / 2).astype(int)
        row = np.floor(camera.focal_length * y / depth + options.height / 2).astype(int)
        is_visible = (depth > 0) & (column >= 0) & (column < 48) & (row >= 0) & (row < 36)
        colors = picture[row[is_visible], column[is_visible]].astype(float)
        matches.append(np.abs(colors - points.colors[is_visible]).mean(axis=1))

    # The colors differ at edges and occlusions, but agree at most pixels.
    assert all(np.median(match) < 20 for match in matches)


def test_the_same_options_give_the_same_bytes(folder, options, tmp_path):
    write_synthetic_capture(tmp_path / "again", options)

    for path in folder.iterdir():
        assert (tmp_path / "again" / path.name).read_bytes() == path.read_bytes()


def test_another_seed_gives_another_scene(folder, options, tmp_path):
    write_synthetic_capture(tmp_path / "other", replace(options, frames=1, seed=1))
    reader, other_reader = (
        VideoReader(folder / "cam00.mp4"),
        VideoReader(tmp_path / "other" / "cam00.mp4"),
    )

    assert np.abs(reader.read(0).astype(float) - other_reader.read(0)).mean() > 5


def test_progress_counts_every_picture(options, tmp_path):
    reports = []
    write_synthetic_capture(
        tmp_path / "c", replace(options, frames=2), lambda *report: reports.append(report)
    )

    assert reports == [(done, 10) for done in range(1, 11)]


def test_a_nonempty_folder_is_rejected_and_unchanged(options, tmp_path):
    (tmp_path / "mine.txt").write_text("keep")
    with pytest.raises(FileExistsError, match=r"mine\.txt"):
        write_synthetic_capture(tmp_path, options)

    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_an_existing_file_is_rejected(options, tmp_path):
    (tmp_path / "taken").write_text("keep")
    with pytest.raises(FileExistsError, match="taken"):
        write_synthetic_capture(tmp_path / "taken", options)


def test_an_empty_folder_is_used(options, tmp_path):
    (tmp_path / "empty").mkdir()
    write_synthetic_capture(tmp_path / "empty", replace(options, frames=1))

    assert (tmp_path / "empty" / "cam04.mp4").is_file()


def test_an_unfinished_capture_leaves_nothing(options, tmp_path, monkeypatch):
    def fail(*_arguments):
        message = "disk full"
        raise OSError(message)

    monkeypatch.setattr(write_capture, "write_points_ply", fail)
    with pytest.raises(OSError, match="disk full"):
        write_synthetic_capture(tmp_path / "half", replace(options, frames=1))

    assert list(tmp_path.iterdir()) == []


def test_a_stage_with_masks_shows_only_the_robot(tmp_path):
    options = SynthOptions(64, 48, frames=2, cameras=3, variant="dark-stage", has_masks=True)
    write_synthetic_capture(tmp_path / "stage", options)

    capture = open_capture(tmp_path / "stage")

    for camera, frame in ((0, 0), (3, 1)):
        alpha = capture.alpha(camera, frame)
        assert 0.01 < (alpha > 0).mean() < 0.2
        assert (capture.image(camera, frame)[alpha == 0] == 0).all()
        assert capture.image(camera, frame)[alpha == 255].mean() > 60
    assert not np.array_equal(capture.alpha(1, 0), capture.alpha(1, 1))
