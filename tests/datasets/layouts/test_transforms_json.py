import math
import shutil
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.datasets.capture_notes import NOTES_NAME, CaptureNotes
from quarc_ref.datasets.errors import (
    CountMismatchError,
    MissingFileError,
    UnknownLayoutError,
    UnreadablePoseError,
)
from quarc_ref.datasets.layouts.transforms_json import read_nerfstudio
from quarc_ref.datasets.notes_file import write_capture_notes
from quarc_ref.datasets.open_capture import open_capture
from tests.datasets import scenes


@pytest.fixture
def folder(n3dv_folder, tmp_path):
    """Videos for a description by a test."""
    return shutil.copytree(n3dv_folder, tmp_path / "copy")


@pytest.fixture
def frames_folder(tmp_path, shots, pictures):
    """Pictures for a description by a test."""
    return scenes.write_frames(tmp_path / "frames_only", shots, pictures)


def test_videos_become_cameras_that_project_like_the_original_ones(folder, shots, points, pictures):
    scenes.write_transforms(folder, scenes.make_video_document(shots), points)
    footage = read_nerfstudio(folder)

    assert [camera.name for camera in footage.cameras] == [shot.name for shot in shots]
    for camera, shot in zip(footage.cameras, shots, strict=True):
        expected = shot.project(points.positions)
        assert np.allclose(scenes.project(camera, points.positions), expected, atol=1e-6)
        assert camera.near is None
    assert (footage.frame_count, footage.frames_per_second) == (6, 30.0)
    assert np.array_equal(footage.source.read(1, 5), pictures[1][5])
    assert np.array_equal(footage.points.positions, points.positions)


def test_videos_without_poses_are_named(folder, shots):
    scenes.write_transforms(folder, scenes.make_video_document(shots))
    assert read_nerfstudio(folder).findings == ()
    for name in ("cam07.mp4", "cam07.mov"):  # of two videos of one camera, none could be used
        shutil.copy(folder / f"{shots[3].name}.mp4", folder / name)
    assert read_nerfstudio(folder).findings == ()
    (folder / "cam07.mov").unlink()

    (finding,) = read_nerfstudio(folder).findings
    assert finding.kind == "camera-without-pose"
    assert finding.message.startswith(
        f"recordings of cam07 have no poses in {folder / 'transforms.json'}, so they are not used"
    )


def test_a_video_of_two_cameras_is_named(folder, shots):
    document = scenes.make_video_document(shots)
    document["frames"][2]["file_path"] = f"./{shots[1].name}.mp4"
    scenes.write_transforms(folder, document)

    with pytest.raises(CountMismatchError, match=rf"names {shots[1].name}.mp4 in entries with dif"):
        read_nerfstudio(folder)


def test_pictures_are_grouped_by_camera_and_sorted_by_time(frames_folder, shots, pictures):
    scenes.write_transforms(frames_folder, scenes.make_picture_document(shots))
    footage = read_nerfstudio(frames_folder)

    assert [camera.name for camera in footage.cameras] == [shot.name for shot in shots]
    assert (footage.frame_count, footage.frames_per_second) == (6, 30.0)
    assert footage.points is None
    for camera, frame in [(0, 0), (3, 5), (1, 2)]:
        assert np.array_equal(footage.source.read(camera, frame), pictures[camera][frame])


@pytest.mark.parametrize("pattern", ["{frame:04d}/{name}.png", "{name}/{frame:04d}.png"])
def test_pictures_without_times_that_lack_different_frames_are_rejected(
    tmp_path, shots, pictures, pattern
):
    for shot, row in zip(shots, pictures, strict=True):
        for frame, picture in enumerate(row):
            scenes.write_picture(tmp_path / pattern.format(frame=frame, name=shot.name), picture)
    document = scenes.make_picture_document(shots, pattern)
    for entry in document["frames"]:
        entry.pop("time", None)
    dropped_frames = {shot.name: 1 + index % 2 for index, shot in enumerate(shots)}
    dropped = {pattern.format(name=name, frame=frame) for name, frame in dropped_frames.items()}

    document["frames"] = [e for e in document["frames"] if e["file_path"] not in dropped]
    scenes.write_transforms(tmp_path, document)
    with pytest.raises(CountMismatchError, match="no pictures of camera cam00 between 0000 and 0"):
        read_nerfstudio(tmp_path)

    document["frames"] = [
        e
        for e in document["frames"]
        if "0001" not in e["file_path"] and "0002" not in e["file_path"]
    ]
    scenes.write_transforms(tmp_path, document)
    assert read_nerfstudio(tmp_path).frame_count == 4


def test_a_file_like_that_of_a_blender_scene_is_read(frames_folder, shots):
    scenes.write_transforms(frames_folder, scenes.make_picture_document(shots))
    expected = read_nerfstudio(frames_folder)
    document = scenes.make_picture_document(shots)
    for entry in document["frames"]:
        entry["file_path"] = f"./{entry['file_path'].removesuffix('.png')}"
        for key in scenes.make_intrinsics(shots[0]):
            del entry[key]
    document["camera_angle_x"] = 2 * math.atan(shots[0].width / shots[0].fx / 2)
    scenes.write_transforms(frames_folder, document)
    footage = read_nerfstudio(frames_folder)

    for camera, expected_camera in zip(footage.cameras, expected.cameras, strict=True):
        lens = expected_camera.lens
        assert camera.name == expected_camera.name
        assert replace(camera.lens, fx=lens.fx, fy=lens.fy) == lens
        assert (camera.lens.fx, camera.lens.fy) == pytest.approx((lens.fx, lens.fy))
    assert footage.source.paths == expected.source.paths


def test_videos_need_a_stated_size(folder, shots):
    document = scenes.make_video_document(shots)
    del document["frames"][0]["w"], document["frames"][0]["h"]
    scenes.write_transforms(folder, document)

    with pytest.raises(UnreadablePoseError, match=r"'w' is missing"):
        read_nerfstudio(folder)


def test_a_given_rate_is_used(folder, frames_folder, shots):
    scenes.write_transforms(folder, scenes.make_video_document(shots, fps=24))
    scenes.write_transforms(frames_folder, {**scenes.make_picture_document(shots), "fps": 12.5})

    videos = read_nerfstudio(folder)
    assert (videos.frames_per_second, len(videos.findings)) == (24, 1)
    assert read_nerfstudio(frames_folder).frames_per_second == 12.5


def test_a_given_rate_that_is_not_that_of_the_videos_is_a_finding(folder, shots, points):
    (folder / "poses_bounds.npy").unlink()
    scenes.write_transforms(folder, scenes.make_video_document(shots, fps=30.001), points)
    assert open_capture(folder).findings == ()
    scenes.write_transforms(folder, scenes.make_video_document(shots, fps=60), points)
    (finding,) = open_capture(folder).findings
    assert finding.kind == "stated-frame-rate"
    assert "states 60 frames per second, but the videos have 30, so the" in finding.message
    assert "is played 2 times as fast" in finding.message
    write_capture_notes(folder / NOTES_NAME, CaptureNotes(frames_per_second=60))
    assert open_capture(folder).findings == ()


@pytest.mark.parametrize(
    ("pattern", "names"),
    [
        ("{frame:04d}/{name}.png", ["cam00", "cam01", "cam03", "cam04"]),
        ("{name}/{frame:04d}.png", ["cam00", "cam01", "cam03", "cam04"]),
        ("{name}/images/{frame:04d}.png", ["cam00", "cam01", "cam03", "cam04"]),
        ("all/{name}_{frame:04d}.png", ["cam00", "cam01", "cam03", "cam04"]),
        ("all/{name}{frame:04d}.png", ["cam00", "cam01", "cam02", "cam03"]),
    ],
)
def test_cameras_are_named_after_the_common_parts_of_their_paths(
    tmp_path, shots, pictures, pattern, names
):
    for shot, row in zip(shots, pictures, strict=True):
        for frame, picture in enumerate(row):
            scenes.write_picture(tmp_path / pattern.format(frame=frame, name=shot.name), picture)
    scenes.write_transforms(tmp_path, scenes.make_picture_document(shots, pattern))

    assert [camera.name for camera in read_nerfstudio(tmp_path).cameras] == names


def test_pictures_that_begin_with_another_number_are_a_finding(tmp_path, shots, pictures):
    entries = []
    for index, (shot, row) in enumerate(zip(shots, pictures, strict=True)):
        for frame, picture in enumerate(row):
            name = f"{shot.name}/{frame + (index == 1):04d}.png"
            scenes.write_picture(tmp_path / name, picture)
            entries.append(scenes.make_entry(shot, name))
    scenes.write_transforms(tmp_path, {"frames": entries})
    (finding,) = read_nerfstudio(tmp_path).findings

    assert finding.kind == "frame-numbers"
    assert finding.cameras == (shots[1].name,)


def test_no_camera_has_an_empty_name(tmp_path, shots, pictures):
    patterns = ["{frame:04d}.png", "side/{frame:04d}.png"]
    entries = []
    for shot, row, pattern in zip(shots[:2], pictures[:2], patterns, strict=True):
        for frame, picture in enumerate(row):
            scenes.write_picture(tmp_path / pattern.format(frame=frame), picture)
            entries.append(scenes.make_entry(shot, pattern.format(frame=frame)))
    scenes.write_transforms(tmp_path, {"frames": entries})

    assert [camera.name for camera in read_nerfstudio(tmp_path).cameras] == ["cam00", "cam01"]


def test_cameras_are_sorted_by_their_numbers(folder, shots, pictures):
    renamed_shots = scenes.rename_shots(shots, ["cam_10", "cam_2", "cam_1", "cam_0"])
    for shot, new in zip(shots, renamed_shots, strict=True):
        (folder / f"{shot.name}.mp4").rename(folder / f"{new.name}.mp4")
    scenes.write_transforms(folder, scenes.make_video_document(renamed_shots))
    footage = read_nerfstudio(folder)

    assert [camera.name for camera in footage.cameras] == ["cam_0", "cam_1", "cam_2", "cam_10"]
    assert np.array_equal(footage.source.read(3, 1), pictures[0][1])


def test_a_missing_picture_is_named(frames_folder, shots):
    (frames_folder / "frames" / "0003" / "cam01.png").unlink()
    scenes.write_transforms(frames_folder, scenes.make_picture_document(shots))

    with pytest.raises(MissingFileError, match=r"json names .*0003/cam01.png, which is missing"):
        read_nerfstudio(frames_folder)


@pytest.mark.parametrize("name", ["cam01.mp4", "points.ply"])
def test_a_missing_video_or_points_file_is_named(folder, shots, points, name):
    scenes.write_transforms(folder, scenes.make_video_document(shots), points)
    (folder / name).unlink()

    with pytest.raises(MissingFileError, match=name):
        read_nerfstudio(folder)


def test_a_camera_without_a_picture_for_some_time_is_named(frames_folder, shots):
    document = scenes.make_picture_document(shots)
    del document["frames"][len(shots) + 1]  # not the last picture of the camera
    scenes.write_transforms(frames_folder, document)

    with pytest.raises(CountMismatchError, match=r"5 pictures of camera cam01 are .* 6 times"):
        read_nerfstudio(frames_folder)


def test_of_cameras_that_end_at_different_times_the_common_frames_are_used(frames_folder, shots):
    document = scenes.make_picture_document(shots)
    del document["frames"][0]  # the last picture of cam00
    scenes.write_transforms(frames_folder, document)
    footage = read_nerfstudio(frames_folder)

    assert (footage.frame_count, list(footage.source.lengths)) == (5, [5, 6, 6, 6])


def test_two_pictures_for_one_time_are_rejected(frames_folder, shots):
    document = scenes.make_picture_document(shots)
    for index, frame in enumerate(document["frames"]):
        frame["time"] = min(index // 4, 4)
    scenes.write_transforms(frames_folder, document)

    with pytest.raises(CountMismatchError, match="camera cam00"):
        read_nerfstudio(frames_folder)


def test_a_camera_that_moves_is_rejected(frames_folder, shots):
    document = scenes.make_picture_document(shots[:1])
    for index, frame in enumerate(document["frames"]):
        frame["transform_matrix"][0][3] += index
    scenes.write_transforms(frames_folder, document)

    with pytest.raises(CountMismatchError, match="every camera must be static"):
        read_nerfstudio(frames_folder)


def test_two_videos_of_one_camera_are_rejected(folder, shots):
    document = scenes.make_video_document(shots)
    document["frames"].append(scenes.make_entry(shots[0], "cam01.mp4"))
    scenes.write_transforms(folder, document)

    with pytest.raises(CountMismatchError, match="2 videos for camera"):
        read_nerfstudio(folder)


def test_pictures_without_times_are_rejected(frames_folder, shots):
    document = scenes.make_picture_document(shots)
    del document["frames"][7]["time"]
    scenes.write_transforms(frames_folder, document)

    with pytest.raises(UnknownLayoutError, match="all pictures must have one"):
        read_nerfstudio(frames_folder)


def test_a_matrix_that_is_not_a_pose_is_rejected_with_the_camera(folder, shots):
    document = scenes.make_video_document(shots)
    document["frames"][1]["transform_matrix"][0][0] += 0.2
    scenes.write_transforms(folder, document)

    with pytest.raises(UnreadablePoseError, match=r"transforms.json: camera cam01: .*orthonormal"):
        read_nerfstudio(folder)
