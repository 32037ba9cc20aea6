import os
import pickle
import shutil

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quarc_ref.datasets.errors import (
    CountMismatchError,
    MissingFileError,
    TruncatedVideoError,
    UnreadablePointsError,
    UnreadablePoseError,
)
from quarc_ref.datasets.layouts.n3dv import read_n3dv
from quarc_ref.datasets.points_ply import write_points_ply
from tests.datasets import scenes


@pytest.fixture
def folder(n3dv_folder, tmp_path):
    """A copy that tests may modify."""
    return shutil.copytree(n3dv_folder, tmp_path / "copy")


@pytest.fixture
def rows(shots):
    return np.array([scenes.make_poses_row(shot) for shot in shots])


def test_cameras_project_like_the_original_ones(n3dv_folder, shots, points):
    footage = read_n3dv(n3dv_folder)

    assert [camera.name for camera in footage.cameras] == ["cam00", "cam01", "cam03", "cam04"]
    for camera, shot in zip(footage.cameras, shots, strict=True):
        expected = shot.project(points.positions)
        assert np.allclose(scenes.project(camera, points.positions), expected, atol=1e-6)
        assert camera.near == 1.5


def test_frames_and_points_equal_those_of_the_files(n3dv_folder, pictures, points):
    footage = read_n3dv(n3dv_folder)

    assert (footage.frame_count, footage.frames_per_second) == (6, 30.0)
    assert np.array_equal(footage.source.read(2, 4), pictures[2][4])
    assert np.array_equal(footage.points.positions, points.positions)


angles = st.floats(-3.1, 3.1)


@settings(deadline=None, max_examples=25)
@given(
    turns=st.tuples(angles, angles, angles),
    center=st.tuples(*[st.floats(-100, 100)] * 3),
    focal=st.floats(10, 5000),
)
def test_every_pose_survives_a_round_trip_through_its_row(
    tmp_path_factory, n3dv_folder, turns, center, focal
):
    folder = tmp_path_factory.mktemp("pose")
    shutil.copy(n3dv_folder / "cam00.mp4", folder)
    axes = np.eye(3)
    for axis, turn in enumerate(turns):
        step = np.eye(3)
        low, high = (axis + 1) % 3, (axis + 2) % 3
        step[[low, high], [low, high]] = np.cos(turn)
        step[low, high], step[high, low] = -np.sin(turn), np.sin(turn)
        axes = axes @ step
    shot = scenes.Shot("cam00", 48, 32, focal, focal, 24, 16, axes, np.array(center))
    np.save(folder / "poses_bounds.npy", [scenes.make_poses_row(shot)])
    (camera,) = read_n3dv(folder).cameras

    assert np.allclose(camera.pose.rotation, axes.T, atol=1e-12)
    assert np.allclose(-camera.pose.rotation.T @ camera.pose.translation, center, atol=1e-9)
    assert camera.lens.fx == camera.lens.fy == pytest.approx(focal)
    assert (camera.lens.cx, camera.lens.cy) == (24, 16)


@pytest.mark.parametrize("size", [(96, 64), (24, 16), (480, 320)])
def test_a_video_resized_by_a_whole_number_scales_the_focal_length(folder, shots, size):
    np.save(folder / "poses_bounds.npy", [scenes.make_poses_row(shot, size=size) for shot in shots])

    assert read_n3dv(folder).cameras[0].lens.fx == pytest.approx(shots[0].fx)


@pytest.mark.parametrize("size", [(72, 48), (96, 63), (48, 33), (50, 32), (0, 0), (-48, -32)])
def test_a_video_of_another_size_is_rejected(folder, shots, size):
    rows = np.array([scenes.make_poses_row(shot) for shot in shots])
    rows[:, 4:15:5][:, :2] = size[::-1]
    np.save(folder / "poses_bounds.npy", rows)

    with pytest.raises(
        UnreadablePoseError, match=r"cam00.*pose is for pictures of .*video is 48x32"
    ):
        read_n3dv(folder)


def test_missing_poses_are_named(folder):
    (folder / "poses_bounds.npy").unlink()

    with pytest.raises(MissingFileError, match=r"poses_bounds.npy is missing"):
        read_n3dv(folder)


def test_missing_videos_are_named(folder):
    for path in folder.glob("*.mp4"):
        path.unlink()

    with pytest.raises(MissingFileError, match=r"no videos or pictures: looked for .*cam00.mp4"):
        read_n3dv(folder)


def test_of_a_missing_video_the_file_that_cannot_be_read_is_named(folder):
    (folder / "cam03.mp4").rename(folder / "cam03.avi")

    with pytest.raises(CountMismatchError, match=r"Files such as cam03.avi cannot be read"):
        read_n3dv(folder)


def test_the_arrangement_with_the_most_cameras_is_counted(folder):
    for name in ("cam00", "cam01", "cam04"):
        video = folder / f"{name}.mp4"
        (folder / name).mkdir()
        video.rename(folder / name / "0000.png")

    with pytest.raises(CountMismatchError, match=r"there are 3 cameras \(cam00, cam01, cam04\)"):
        read_n3dv(folder)


def test_another_number_of_poses_than_videos_is_rejected(folder):
    (folder / "cam03.mp4").unlink()

    with pytest.raises(
        CountMismatchError,
        match=r"4 poses, but there are 3 cameras \(cam00, cam01, cam04\): add the missing videos",
    ):
        read_n3dv(folder)


def test_a_single_camera_is_named_in_the_singular(folder):
    for name in ("cam01", "cam03", "cam04"):
        (folder / f"{name}.mp4").unlink()

    with pytest.raises(CountMismatchError, match=r"there is 1 camera \(cam00\)"):
        read_n3dv(folder)


def test_of_more_videos_than_poses_those_without_a_pose_are_to_be_moved(folder):
    shutil.copy(folder / "cam04.mp4", folder / "cam05.mp4")

    with pytest.raises(CountMismatchError, match=r"are 5 cameras .*: move the videos without a"):
        read_n3dv(folder)


def test_names_with_two_possible_orders_are_sorted_by_number_with_a_message(folder):
    for name in ("cam00", "cam01", "cam03", "cam04"):
        (folder / f"{name}.mp4").rename(folder / f"cam_{int(name[3:]) + 7}.mp4")
    footage = read_n3dv(folder)

    assert [camera.name for camera in footage.cameras] == ["cam_7", "cam_8", "cam_10", "cam_11"]
    (finding,) = footage.findings
    assert finding.kind == "order-of-poses"
    assert "numeric order, where cam_7 comes before cam_11" in finding.message


def test_a_video_of_another_length_is_named(folder, pictures):
    scenes.write_video(folder / "cam03.mp4", pictures[2][:5])
    footage = read_n3dv(folder)

    assert footage.frame_count == 5
    assert footage.source.lengths == (6, 6, 5, 6)


def test_a_truncated_video_is_named(folder):
    path = folder / "cam03.mp4"
    path.write_bytes(path.read_bytes()[:-200])

    with pytest.raises(TruncatedVideoError, match=r"cam03.mp4"):
        read_n3dv(folder)


def test_poses_with_pickled_objects_are_rejected_unopened(folder):
    class Bomb:
        def __reduce__(self):
            return (pytest.fail, ("the pickle was opened",))

    path = folder / "poses_bounds.npy"
    path.write_bytes(pickle.dumps(Bomb()))
    with pytest.raises(UnreadablePoseError, match=r"poses_bounds.npy is not an array of numbers"):
        read_n3dv(folder)

    np.save(path, np.array([[Bomb()]], dtype=object), allow_pickle=True)
    with pytest.raises(UnreadablePoseError, match=r"poses_bounds.npy is not an array of numbers"):
        read_n3dv(folder)


@pytest.mark.parametrize(
    "array",
    [
        np.zeros((4, 16)),
        np.zeros((4, 3, 5)),
        np.zeros(17),
        np.zeros((0, 17)),
        np.zeros((4, 17), dtype=complex),
        np.zeros((4, 17), dtype="U3"),
    ],
)
def test_an_array_of_another_shape_or_type_is_rejected(folder, array):
    np.save(folder / "poses_bounds.npy", array)

    with pytest.raises(UnreadablePoseError, match=r"poses_bounds.npy (is not an array|has shape)"):
        read_n3dv(folder)


def test_an_archive_of_arrays_is_rejected(folder, rows):
    with (folder / "poses_bounds.npy").open("wb") as file:
        np.savez(file, rows=rows)

    with pytest.raises(UnreadablePoseError, match="not an array of numbers"):
        read_n3dv(folder)


def test_a_header_with_a_huge_shape_is_rejected_without_allocation(folder):
    with (folder / "poses_bounds.npy").open("wb") as file:
        header = {"descr": "<f8", "fortran_order": False, "shape": (1 << 40, 17)}
        np.lib.format.write_array_header_1_0(file, header)

    with pytest.raises(UnreadablePoseError, match="not an array of numbers"):
        read_n3dv(folder)


@settings(deadline=None, max_examples=100)
@given(data=st.data())
def test_a_wrong_byte_in_the_poses_gives_poses_or_a_named_error(
    tmp_path_factory, n3dv_folder, data
):
    folder = tmp_path_factory.getbasetemp() / "wrong_byte"
    if not folder.exists():
        shutil.copytree(n3dv_folder, folder)
    whole = bytearray((n3dv_folder / "poses_bounds.npy").read_bytes())
    whole[data.draw(st.integers(0, 150))] = data.draw(st.integers(0, 255))
    (folder / "poses_bounds.npy").write_bytes(whole[: data.draw(st.integers(100, len(whole)))])

    try:
        footage = read_n3dv(folder)
    except (UnreadablePoseError, CountMismatchError):
        return
    assert len(footage.cameras) == 4


@pytest.mark.parametrize(
    ("change", "error"),
    [
        (lambda row: row.__setitem__(3, np.nan), r"row 1 .*not finite"),
        (lambda row: row.__setitem__(0, row[0] + 0.1), "cam01: .*not orthonormal"),
        (lambda row: row.__setitem__([0, 5, 10], -row[[0, 5, 10]]), "cam01: .*left-handed"),
        (lambda row: row.__setitem__(14, -40.0), "cam01: .*focal lengths must be positive"),
        (
            lambda row: row.__setitem__(15, 0.0),
            "cam01: .*must be positive and less than the far depth",
        ),
        (
            lambda row: row.__setitem__(16, 1.0),
            "cam01: .*must be positive and less than the far depth",
        ),
    ],
)
def test_rows_that_are_not_poses_are_rejected_with_the_camera(folder, rows, change, error):
    change(rows[1])
    np.save(folder / "poses_bounds.npy", rows)

    with pytest.raises(UnreadablePoseError, match=error):
        read_n3dv(folder)


def test_missing_initial_points_are_replaced_by_other_ones(folder, points):
    (folder / "points3D_init.ply").unlink()
    assert read_n3dv(folder).points is None

    write_points_ply(folder / "points3D_downsample2.ply", points)
    assert np.array_equal(read_n3dv(folder).points.colors, points.colors)


@pytest.mark.skipif(os.name == "nt", reason="no named pipes")
def test_a_named_pipe_has_no_initial_points(folder):
    (folder / "points3D_init.ply").unlink()
    os.mkfifo(folder / "points3D_init.ply")

    assert read_n3dv(folder).points is None


def test_malformed_points_are_named(folder):
    (folder / "points3D_init.ply").write_bytes(b"ply\n")

    with pytest.raises(UnreadablePointsError, match=r"points3D_init.ply"):
        read_n3dv(folder)
