import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.capture_notes import NOTES_NAME, CaptureNotes
from quarc_ref.datasets.errors import (
    CountMismatchError,
    FrameRateError,
    HeldOutError,
    MissingCameraError,
    StartError,
    UnknownLayoutError,
    UnreadablePointsError,
    UnsupportedCameraError,
)
from quarc_ref.datasets.notes_file import write_capture_notes
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from tests.datasets import scenes
from tests.datasets.lenses import BARREL, distort


@pytest.fixture(scope="module")
def folders(tmp_path_factory, n3dv_folder, shots, points, pictures):
    """The same capture in every layout."""
    parent = tmp_path_factory.mktemp("layouts")
    videos = shutil.copytree(n3dv_folder, parent / "videos")
    (videos / "poses_bounds.npy").unlink()
    scenes.write_transforms(videos, scenes.make_video_document(shots), points)
    scenes.write_frames(parent / "pictures", shots, pictures)
    scenes.write_transforms(parent / "pictures", scenes.make_picture_document(shots), points)
    scenes.write_frames(parent / "colmap", shots, pictures)
    scenes.write_model(parent / "colmap" / "sparse" / "0", shots, points)
    return {"n3dv": n3dv_folder} | {
        name: parent / name for name in ("videos", "pictures", "colmap")
    }


def list_calibration(camera):
    intrinsics = (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
    return np.array([*intrinsics, *camera.rotation, *camera.translation])


@pytest.mark.parametrize("layout", ["videos", "pictures", "colmap"])
@pytest.mark.parametrize("downscale", [1, 3])
def test_every_layout_gives_the_same_capture(folders, layout, downscale):
    options = CaptureOptions(downscale=downscale, held_out=("cam01",))
    n3dv_capture, layout_capture = (
        open_capture(folders[name], options) for name in ("n3dv", layout)
    )

    assert layout_capture.held_out == n3dv_capture.held_out == (1,)
    assert layout_capture.frame_count == n3dv_capture.frame_count
    assert layout_capture.frames_per_second == n3dv_capture.frames_per_second
    assert np.array_equal(layout_capture.points.positions, n3dv_capture.points.positions)
    for index, (camera, n3dv_camera) in enumerate(
        zip(layout_capture.cameras, n3dv_capture.cameras, strict=True)
    ):
        assert camera.name == n3dv_camera.name
        assert np.allclose(
            list_calibration(camera), list_calibration(n3dv_camera), rtol=0, atol=1e-6
        )
        assert np.array_equal(layout_capture.image(index, 4), n3dv_capture.image(index, 4))


@pytest.mark.parametrize("layout", ["n3dv", "videos", "pictures", "colmap"])
def test_a_fingerprint_distinguishes_captures_but_not_options(folders, layout):
    fingerprint = open_capture(folders[layout]).fingerprint
    other_fingerprints = {
        open_capture(path).fingerprint for name, path in folders.items() if name != layout
    }

    assert open_capture(folders[layout], CaptureOptions(downscale=2)).fingerprint == fingerprint
    assert fingerprint not in other_fingerprints


def test_a_capture_is_named_after_its_folder(n3dv_folder, monkeypatch):
    monkeypatch.chdir(n3dv_folder)

    assert open_capture(Path()).name == "plane"


def test_the_first_camera_is_held_out_unless_others_are_named(n3dv_folder):
    default_capture = open_capture(n3dv_folder)
    chosen_capture = open_capture(n3dv_folder, CaptureOptions(held_out=("cam04", "cam01")))

    assert (default_capture.held_out, default_capture.training) == ((0,), (1, 2, 3))
    assert (chosen_capture.held_out, chosen_capture.training) == ((1, 3), (0, 2))


def test_an_unknown_held_out_camera_is_rejected_with_the_known_ones(n3dv_folder):
    with pytest.raises(
        MissingCameraError,
        match=r"hold out camera cam02: the cameras are cam00, cam01, cam03",
    ):
        open_capture(n3dv_folder, CaptureOptions(held_out=("cam00", "cam02")))


def test_holding_out_every_camera_is_rejected(n3dv_folder):
    names = ("cam00", "cam01", "cam03", "cam04")

    with pytest.raises(MissingCameraError, match="no camera is left for training"):
        open_capture(n3dv_folder, CaptureOptions(held_out=names))


@pytest.mark.parametrize(("max_frames", "count"), [(1, 1), (5, 5), (100, 6)])
def test_the_number_of_frames_can_be_limited(n3dv_folder, max_frames, count):
    assert open_capture(n3dv_folder, CaptureOptions(max_frames=max_frames)).frame_count == count


def test_frames_can_start_later(n3dv_folder, pictures):
    capture = open_capture(n3dv_folder, CaptureOptions(start=2, max_frames=3))

    assert (capture.start, capture.frame_count) == (2, 3)
    assert np.array_equal(capture.image(1, 2), pictures[1][4])
    assert open_capture(n3dv_folder, CaptureOptions(start=2)).frame_count == 4


def test_a_start_after_the_last_frame_is_rejected(n3dv_folder):
    with pytest.raises(
        StartError, match=r"cannot start at frame 6: .* 6 frames common to all cameras"
    ):
        open_capture(n3dv_folder, CaptureOptions(start=6))


@pytest.mark.parametrize("frame_rate", [math.nan, math.inf, 1e-4, 1e7])
def test_a_frame_rate_that_no_stream_can_state_is_rejected(
    n3dv_folder, shots, points, tmp_path, frame_rate
):
    folder = shutil.copytree(n3dv_folder, tmp_path / "copy")
    (folder / "poses_bounds.npy").unlink()
    document = scenes.make_video_document(shots, fps=frame_rate)
    scenes.write_transforms(folder, document, points)

    with pytest.raises(FrameRateError, match=r"from 0\.001 to 1,000,000: correct 'fps'"):
        open_capture(folder)


def test_the_notes_state_the_frame_rate_of_pictures(folders, tmp_path):
    folder = shutil.copytree(folders["pictures"], tmp_path / "copy")
    assert open_capture(folder).frames_per_second == 30

    write_capture_notes(folder / NOTES_NAME, CaptureNotes(frames_per_second=23.976))
    assert open_capture(folder).frames_per_second == 23.976


def test_a_single_camera_cannot_be_trained(n3dv_folder, tmp_path):
    folder = shutil.copytree(n3dv_folder, tmp_path / "copy")
    for path in sorted(folder.glob("cam*.mp4"))[1:]:
        path.unlink()
    np.save(folder / "poses_bounds.npy", np.load(folder / "poses_bounds.npy")[:1])

    with pytest.raises(HeldOutError, match="is the only camera, and training needs at least two"):
        open_capture(folder)


def test_cameras_are_synchronized_by_the_offsets_in_the_notes(n3dv_folder, pictures, tmp_path):
    folder = shutil.copytree(n3dv_folder, tmp_path / "copy")
    write_capture_notes(folder / NOTES_NAME, CaptureNotes({"cam01": 2.2, "cam04": -1}))
    capture = open_capture(folder, CaptureOptions(start=1))

    assert capture.frame_count == 6 - 1 - 3
    for camera, first_frame in enumerate((2, 4, 2, 1)):
        assert np.array_equal(capture.image(camera, 1), pictures[camera][first_frame + 1])
    assert capture.findings == ()
    assert capture.fingerprint != open_capture(n3dv_folder).fingerprint


def test_offsets_that_leave_no_common_frame_are_rejected(n3dv_folder, tmp_path):
    folder = shutil.copytree(n3dv_folder, tmp_path / "copy")
    write_capture_notes(folder / NOTES_NAME, CaptureNotes({"cam01": 6}))

    with pytest.raises(CountMismatchError, match=r"quarc-capture\.json skip all frames of cam01:"):
        open_capture(folder)


def test_an_offset_of_an_unknown_camera_is_rejected(n3dv_folder, tmp_path):
    folder = shutil.copytree(n3dv_folder, tmp_path / "copy")
    write_capture_notes(folder / NOTES_NAME, CaptureNotes({"cam02": 1}))

    with pytest.raises(MissingCameraError, match="not in the capture: cam02"):
        open_capture(folder)


@pytest.mark.parametrize("options", [{"downscale": 0}, {"max_frames": 0}, {"start": -1}])
def test_options_that_make_no_sense_are_rejected(options):
    with pytest.raises(ValueError, match=r"at least 1|at least 0"):
        CaptureOptions(**options)


def test_a_downscale_larger_than_the_picture_is_rejected(n3dv_folder):
    with pytest.raises(ValueError, match="48x32 cannot be downscaled by 40"):
        open_capture(n3dv_folder, CaptureOptions(downscale=40))


def test_a_folder_of_unknown_layout_is_rejected(tmp_path):
    with pytest.raises(UnknownLayoutError, match=r"poses_bounds.npy.*transforms.json.*sparse/0"):
        open_capture(tmp_path)


def test_a_missing_folder_is_rejected(tmp_path):
    with pytest.raises(UnknownLayoutError, match="nowhere"):
        open_capture(tmp_path / "nowhere")


def test_an_unknown_near_bound_is_computed_from_the_visible_points(folders, shots, points):
    capture = open_capture(folders["videos"])

    for camera, shot in zip(capture.cameras, shots, strict=True):
        x, y, depths = shot.project(points.positions).T
        inside = (x >= 0) & (x <= shot.width) & (y >= 0) & (y <= shot.height)
        assert inside.sum() > 0
        assert camera.near == pytest.approx(np.quantile(depths[inside], 0.01), rel=1e-5)


def test_points_that_a_camera_cannot_see_are_rejected(folders, tmp_path, shots, points):
    folder = shutil.copytree(folders["videos"], tmp_path / "copy")
    points_behind = Points(points.positions - np.float32(50.0), points.colors)
    scenes.write_transforms(folder, scenes.make_video_document(shots), points_behind)

    with pytest.raises(UnreadablePointsError, match=r"none of the 200 initial points: check its"):
        open_capture(folder)


def test_poses_with_the_axes_of_opencv_are_named(folders, tmp_path, shots, points):
    folder = shutil.copytree(folders["videos"], tmp_path / "copy")
    document = scenes.make_video_document(shots)
    for entry in document["frames"]:
        matrix = np.array(entry["transform_matrix"])
        matrix[:, 1:3] *= -1
        entry["transform_matrix"] = matrix.tolist()
    scenes.write_transforms(folder, document, points)

    with pytest.raises(
        UnreadablePointsError, match=r"would see \d+ .* looked backwards, .* OpenGL"
    ):
        open_capture(folder)


def test_missing_points_are_triangulated_from_the_training_cameras(tmp_path):
    shots = scenes.make_shots(count=5, size=(160, 120), focal=150.0)
    pictures = [[scenes.render(shot, painting=scenes.paint_grains, samples=4)] for shot in shots]
    pictures[0][0] = np.random.default_rng(1).integers(0, 256, pictures[0][0].shape, np.uint8)
    scenes.write_frames(tmp_path, shots, pictures)
    scenes.write_transforms(tmp_path, scenes.make_picture_document(shots, frame_count=1))
    capture = open_capture(tmp_path)
    plane_distances = np.abs(capture.points.positions[:, 1])

    assert np.median(plane_distances) < 0.01
    assert all(3.0 < camera.near < 4.5 for camera in capture.cameras)


def test_distorted_pictures_become_those_of_the_pinhole_camera(tmp_path, shots, points):
    distorted_shot = replace(shots[0], width=96, height=64, fx=70.0, fy=72.0, cx=50.0, cy=30.0)
    pixels = distorted_shot.project(points.positions)[:, :2]
    u, v = distort(
        BARREL,
        (pixels[:, 0] - distorted_shot.cx) / distorted_shot.fx,
        (pixels[:, 1] - distorted_shot.cy) / distorted_shot.fy,
    )
    spot_index = int(np.hypot(u - 30, v - 20).argmin())
    picture = draw_spot(u[spot_index], v[spot_index], distorted_shot)
    second_shot = replace(distorted_shot, name="cam01")
    scenes.write_frames(tmp_path, [distorted_shot, second_shot], [[picture], [picture]])
    coefficients = BARREL.coefficients
    scenes.write_model(
        tmp_path / "sparse",
        [distorted_shot, second_shot],
        points,
        model="OPENCV",
        extra_params=coefficients,
    )
    capture = open_capture(tmp_path)
    rectified = capture.image(0, 0)[..., 0].astype(float)
    camera = capture.cameras[0]
    position = (
        np.reshape(camera.rotation, (3, 3)) @ points.positions[spot_index] + camera.translation
    )
    expected = [
        camera.fx * position[0] / position[2] + camera.cx,
        camera.fy * position[1] / position[2] + camera.cy,
    ]
    rows, columns = np.indices(rectified.shape) + 0.5

    center = [
        (rectified * columns).sum() / rectified.sum(),
        (rectified * rows).sum() / rectified.sum(),
    ]
    assert center == pytest.approx(expected, abs=0.1)


def draw_spot(u, v, shot):
    """Return a black picture with a blurred white spot at a pixel position."""
    rows, columns = np.indices((shot.height, shot.width)) + 0.5
    spot = 255 * np.exp(-((columns - u) ** 2 + (rows - v) ** 2) / 8)
    return np.repeat(spot[..., None], 3, axis=2).astype(np.uint8)


def test_a_lens_that_cannot_be_undistorted_is_named_with_its_camera(folders, tmp_path, shots):
    folder = shutil.copytree(folders["videos"], tmp_path / "copy")
    document = scenes.make_video_document(shots, camera_model="OPENCV_FISHEYE")
    document["frames"][2] |= {"fl_x": 5.0, "fl_y": 5.0}
    scenes.write_transforms(folder, document)

    with pytest.raises(UnsupportedCameraError, match="camera cam03: the field of view is too wide"):
        open_capture(folder)


@pytest.fixture(scope="module")
def basketball(real_capture):
    return open_capture(real_capture)


@pytest.mark.capture
def test_the_real_capture_has_its_cameras_frames_and_bounds(basketball):
    assert [camera.name for camera in basketball.cameras] == [f"cam{i:02d}" for i in range(30)]
    assert (basketball.frame_count, basketball.frames_per_second) == (60, 30.0)
    assert {(camera.width, camera.height) for camera in basketball.cameras} == {(400, 224)}
    assert basketball.cameras[0].near == pytest.approx(1.01, abs=0.01)
    assert basketball.held_out == (0,)
    assert basketball.image(29, 59).shape == (224, 400, 3)


@pytest.mark.capture
def test_the_real_captures_points_lie_in_its_pictures_and_match_their_colors(basketball):
    points = basketball.points
    differences = []
    for index, camera in enumerate(basketball.cameras):
        rotation = np.reshape(camera.rotation, (3, 3))
        x, y, z = (points.positions @ rotation.T + camera.translation).T
        columns, rows = (camera.fx * x / z + camera.cx), (camera.fy * y / z + camera.cy)
        inside = (z > 0) & (columns >= 0) & (columns < 400) & (rows >= 0) & (rows < 224)
        assert inside.mean() > 0.2
        pixels = basketball.image(index, 0)[rows[inside].astype(int), columns[inside].astype(int)]
        differences.append(np.abs(pixels.astype(int) - points.colors[inside]).mean())

    # Occluded points differ in color, so the median over the cameras is compared.
    assert np.median(differences) < 30
