"""Tests of videos with a display rotation, and of pictures with an EXIF orientation."""

import shutil

import cv2
import numpy as np
import pytest

from quarc_ref.datasets.errors import UnreadablePoseError, UnreadableVideoError
from quarc_ref.datasets.layouts.n3dv import read_n3dv
from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.datasets.stills import read_still
from quarc_ref.datasets.video import VideoReader
from tests.datasets import forgeries, scenes

# The OpenCV constant for each display rotation of a video.
OPENCV_ROTATIONS = {
    "90 clockwise": cv2.ROTATE_90_CLOCKWISE,
    "half a turn": cv2.ROTATE_180,
    "90 counterclockwise": cv2.ROTATE_90_COUNTERCLOCKWISE,
}


@pytest.mark.parametrize("display", OPENCV_ROTATIONS)
def test_the_pictures_of_a_rotated_video_are_upright(n3dv_folder, pictures, tmp_path, display):
    path = tmp_path / "cam00.mp4"
    path.write_bytes(forgeries.show_video((n3dv_folder / "cam00.mp4").read_bytes(), display))
    reader = VideoReader(path)

    assert (reader.height, reader.width) == ((48, 32) if "90" in display else (32, 48))
    for frame in (0, 4, 2):
        assert np.array_equal(
            reader.read(frame), cv2.rotate(pictures[0][frame], OPENCV_ROTATIONS[display])
        )


@pytest.mark.parametrize("display", OPENCV_ROTATIONS)
def test_a_video_is_rotated_as_by_opencv(n3dv_folder, tmp_path, display):
    path = tmp_path / "cam00.mp4"
    path.write_bytes(forgeries.show_video((n3dv_folder / "cam00.mp4").read_bytes(), display))
    is_read, opencv_picture = cv2.VideoCapture(str(path)).read()

    assert is_read
    decoded = VideoReader(path).read(0).astype(int)
    assert decoded.shape == opencv_picture.shape
    assert np.abs(decoded - opencv_picture[..., ::-1]).mean() < 4


def test_a_video_displayed_as_stored_is_not_rotated(n3dv_folder, pictures, tmp_path):
    path = tmp_path / "cam00.mp4"
    path.write_bytes(forgeries.show_video((n3dv_folder / "cam00.mp4").read_bytes(), "as stored"))

    assert np.array_equal(VideoReader(path).read(1), pictures[0][1])


@pytest.mark.parametrize(
    ("display", "message"),
    [
        ("45 clockwise", r"rotated by -45 degrees"),
        ("mirrored", "mirrored"),
        ("upside down in a mirror", "mirrored"),
        ("transposed", "mirrored"),
    ],
)
def test_a_video_with_another_angle_than_quarter_turns_is_rejected(
    n3dv_folder, tmp_path, display, message
):
    path = tmp_path / "cam00.mp4"
    path.write_bytes(forgeries.show_video((n3dv_folder / "cam00.mp4").read_bytes(), display))

    with pytest.raises(UnreadableVideoError, match=rf"frame 0 of .*cam00.mp4 .*stored {message}"):
        VideoReader(path)


@pytest.fixture
def rotated_capture(n3dv_folder, tmp_path, shots, pictures):
    """The capture of `n3dv_folder` with videos stored rotated; display matrices turn them back."""
    folder = shutil.copytree(n3dv_folder, tmp_path / "side")
    for shot, camera_pictures in zip(shots, pictures, strict=True):
        path = folder / f"{shot.name}.mp4"
        scenes.write_video(
            path, [cv2.rotate(picture, cv2.ROTATE_90_CLOCKWISE) for picture in camera_pictures]
        )
        path.write_bytes(forgeries.show_video(path.read_bytes(), "90 counterclockwise"))
    return folder


@pytest.mark.parametrize("layout", ["n3dv", "nerfstudio"])
def test_intrinsics_are_those_of_upright_pictures(
    rotated_capture, n3dv_folder, shots, points, layout
):
    if layout == "nerfstudio":
        (rotated_capture / "poses_bounds.npy").unlink()
        scenes.write_transforms(rotated_capture, scenes.make_video_document(shots), points)
    upright_capture, opened_capture = open_capture(n3dv_folder), open_capture(rotated_capture)

    for index, (camera, upright_camera) in enumerate(
        zip(opened_capture.cameras, upright_capture.cameras, strict=True)
    ):
        assert (camera.width, camera.height, camera.fx) == (
            48,
            32,
            pytest.approx(upright_camera.fx),
        )
        assert (camera.cx, camera.cy) == (upright_camera.cx, upright_camera.cy)
        difference = opened_capture.image(index, 3).astype(int) - upright_capture.image(index, 3)
        assert np.abs(difference).mean() < 6


def test_poses_of_unrotated_pictures_are_rejected(rotated_capture, shots):
    rows = [scenes.make_poses_row(shot, size=(32, 48)) for shot in shots]
    np.save(rotated_capture / "poses_bounds.npy", np.array(rows))

    message = r"pictures of 32x48, but the video is 48x32; .*: a rotation flag .* remove the flag"
    with pytest.raises(UnreadablePoseError, match=message):
        read_n3dv(rotated_capture)


@pytest.mark.parametrize(
    ("flag", "remedy"),
    [("90 clockwise", "a rotation flag .* remove the flag"), ("as stored", "rotate the pictures")],
)
def test_pictures_on_their_side_are_not_to_be_resized(n3dv_folder, tmp_path, shots, flag, remedy):
    folder = shutil.copytree(n3dv_folder, tmp_path / "side")
    (folder / "poses_bounds.npy").unlink()
    scenes.write_transforms(folder, scenes.make_video_document(shots))
    path = folder / "cam03.mp4"
    if flag == "as stored":
        scenes.write_video(path, [np.zeros((48, 32, 3), np.uint8)] * 6)
    path.write_bytes(forgeries.show_video(path.read_bytes(), flag))

    message = rf"frame 0 of camera cam03 is 32x48, but its calibration is for 48x32: {remedy}"
    with pytest.raises(UnreadableVideoError, match=message):
        open_capture(folder)


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("orientation", range(2, 9))
def test_a_picture_with_an_exif_orientation_is_rejected(tmp_path, orientation, order):
    scenes.write_picture(tmp_path / "a.jpg", np.zeros((32, 48, 3), np.uint8))
    exif = forgeries.forge_exif(orientation, order)
    data = forgeries.add_exif((tmp_path / "a.jpg").read_bytes(), exif)
    (tmp_path / "a.jpg").write_bytes(data)
    (tmp_path / "a.png").write_bytes(forgeries.forge_png(48, 32, exif))

    for name in ("a.jpg", "a.png"):
        message = rf"{name} has EXIF orientation {orientation}, .*exiftool .*mogrify"
        with pytest.raises(UnreadableVideoError, match=message):
            read_still(tmp_path / name)


def test_a_picture_with_the_exif_orientation_of_upright_pictures_is_read(tmp_path, pictures):
    scenes.write_picture(tmp_path / "a.jpg", pictures[0][0])
    expected = read_still(tmp_path / "a.jpg")
    data = forgeries.add_exif((tmp_path / "a.jpg").read_bytes(), forgeries.forge_exif(1))
    (tmp_path / "a.jpg").write_bytes(data)

    assert np.array_equal(read_still(tmp_path / "a.jpg"), expected)
