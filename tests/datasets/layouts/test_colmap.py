import os
import shutil

import numpy as np
import pycolmap
import pytest

from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.colmap_cameras import CAMERA_MODELS, make_lens
from quarc_ref.datasets.errors import (
    CountMismatchError,
    MissingCameraError,
    MissingFileError,
    UnreadablePoseError,
    UnsupportedCameraError,
)
from quarc_ref.datasets.layouts.colmap import find_model, read_colmap
from tests.datasets import lenses, scenes


@pytest.fixture(scope="module")
def source_folder(tmp_path_factory, shots, points, pictures):
    folder = tmp_path_factory.mktemp("colmap") / "plane"
    scenes.write_model(folder / "sparse" / "0", shots, points)
    return scenes.write_frames(folder, shots, pictures)


@pytest.fixture
def folder(source_folder, tmp_path):
    """A copy that tests may modify."""
    return shutil.copytree(source_folder, tmp_path / "copy")


def read(folder):
    return read_colmap(folder)


def rewrite_model(folder, shots, points, **options):
    shutil.rmtree(folder / "sparse")
    scenes.write_model(folder / "sparse" / "0", shots, points, **options)


@pytest.mark.parametrize("text", [False, True])
def test_cameras_project_like_the_original_ones(folder, shots, points, text):
    rewrite_model(folder, shots, points, text=text)
    footage = read(folder)

    assert [camera.name for camera in footage.cameras] == [shot.name for shot in shots]
    for camera, shot in zip(footage.cameras, shots, strict=True):
        expected = shot.project(points.positions)
        assert np.allclose(scenes.project(camera, points.positions), expected, atol=1e-6)


def test_frames_and_points_equal_those_of_the_files(source_folder, pictures, points):
    footage = read(source_folder)

    assert (footage.frame_count, footage.frames_per_second) == (6, 30.0)
    assert np.array_equal(footage.source.read(2, 4), pictures[2][4])
    assert np.array_equal(footage.points.positions, points.positions)
    assert np.array_equal(footage.points.colors, points.colors)


@pytest.mark.skipif(os.name == "nt", reason="no named pipes")
def test_a_named_pipe_does_not_describe_the_model(folder):
    os.mkfifo(folder / "sparse" / "0" / "log.txt")

    assert folder / "sparse" / "0" / "log.txt" not in read(folder).files.description_files


def test_a_near_bound_follows_from_the_points_that_the_camera_sees(source_folder, shots, points):
    footage = read(source_folder)

    for camera, shot in zip(footage.cameras, shots, strict=True):
        depths = shot.project(points.positions[::2])[:, 2]
        assert camera.near == pytest.approx(np.quantile(depths, 0.01))


def test_a_model_without_points_has_neither_points_nor_near_bounds(folder, shots):
    rewrite_model(folder, shots, None)
    footage = read(folder)

    assert footage.points is None
    assert [camera.near for camera in footage.cameras] == [None] * 4


@pytest.mark.parametrize("place", ["sparse/0", "sparse", "sparse_/0", "."])
def test_a_model_is_found_in_its_usual_places(tmp_path, shots, place):
    scenes.write_model(tmp_path / place, shots)

    assert find_model(tmp_path) == tmp_path / place


def test_without_a_model_none_is_found(tmp_path):
    (tmp_path / "sparse" / "0").mkdir(parents=True)

    assert find_model(tmp_path) is None


def test_cameras_are_sorted_by_their_numbers(folder, shots, pictures):
    renamed_shots = scenes.rename_shots(shots, ["cam_10", "cam_2", "cam_1", "cam_0"])
    rewrite_model(folder, renamed_shots, None)
    scenes.write_frames(folder, renamed_shots, pictures)
    footage = read(folder)

    assert [camera.name for camera in footage.cameras] == ["cam_0", "cam_1", "cam_2", "cam_10"]
    assert np.array_equal(footage.source.read(3, 1), pictures[0][1])


def test_images_in_folders_are_named_after_their_folders(folder, shots):
    rewrite_model(folder, scenes.rename_shots(shots, [f"{shot.name}/0000" for shot in shots]), None)

    assert [camera.name for camera in read(folder).cameras] == [shot.name for shot in shots]


def test_cameras_that_colmap_has_not_registered_are_named(folder, shots, points):
    assert read(folder).findings == ()
    rewrite_model(folder, shots[:3], points)
    footage = read(folder)

    assert [camera.name for camera in footage.cameras] == [shot.name for shot in shots[:3]]
    (finding,) = footage.findings
    assert finding.kind == "camera-without-pose"
    assert finding.message.startswith(f"recordings of {shots[3].name} have no poses in ")


def test_a_larger_model_than_the_used_one_is_named(folder, shots, points):
    rewrite_model(folder, shots, points)
    for name, count in (("1", 3), ("2", 4)):
        scenes.write_model(folder / "sparse" / name, shots[:count], points)
    (folder / "sparse" / "3").mkdir()
    assert read(folder).findings == ()
    shutil.rmtree(folder / "sparse" / "0")
    scenes.write_model(folder / "sparse" / "0", shots[:2], points)

    finding = read(folder).findings[-1]
    assert finding.kind == "larger-model"
    assert finding.message.startswith(f"{folder / 'sparse' / '2'} has poses of 4 images, and ")
    assert "which is used, only of 2: " in finding.message


def test_other_folders_with_pictures_need_no_poses(source_folder, tmp_path, shots, pictures):
    shutil.copytree(source_folder / "sparse", tmp_path / "sparse")
    for shot, camera_pictures in zip(shots, pictures, strict=True):
        scenes.write_picture(tmp_path / shot.name / "0000.png", camera_pictures[0])
    scenes.write_picture(tmp_path / "images_8" / "cam00.png", pictures[0][0])

    assert read(tmp_path).findings == ()


def test_a_model_with_several_images_per_camera_is_rejected(folder, shots):
    rewrite_model(folder, scenes.rename_shots(shots, ["a/0", "a/1", "b/0", "b/1"]), None)

    with pytest.raises(UnreadablePoseError, match="one image per camera"):
        read(folder)


@pytest.mark.parametrize(
    ("model", "extra", "coefficients"),
    [
        ("PINHOLE", (), ()),
        ("OPENCV", (0.1, 0.02, 0.003, 0.004), (0.1, 0.02, 0.003, 0.004)),
        ("FULL_OPENCV", tuple(np.arange(8) / 100), tuple(np.arange(8) / 100)),
        ("OPENCV_FISHEYE", (0.1, 0.02, 0.003, 0.004), (0.1, 0.02, 0.003, 0.004)),
    ],
)
def test_lenses_of_two_focal_lengths_are_read(folder, shots, model, extra, coefficients):
    rewrite_model(folder, shots, None, model=model, extra_params=extra)
    lens = read(folder).cameras[0].lens

    assert (lens.width, lens.height) == (48, 32)
    assert (lens.fx, lens.fy, lens.cx, lens.cy) == (40, 40, 24, 16)
    assert lens.coefficients == coefficients
    assert lens.fisheye == (model == "OPENCV_FISHEYE")


@pytest.mark.parametrize(
    ("model", "coefficients"),
    [
        ("SIMPLE_PINHOLE", ()),
        ("SIMPLE_RADIAL", (0.1,)),
        ("RADIAL", (0.1, 0.02)),
        ("SIMPLE_RADIAL_FISHEYE", (0.1,)),
        ("RADIAL_FISHEYE", (0.1, 0.02)),
    ],
)
def test_lenses_of_one_focal_length_are_read(folder, shots, model, coefficients):
    rewrite_model(folder, shots, None, text=True)
    cameras = folder / "sparse" / "0" / "cameras.txt"
    numbers = " ".join(map(str, (40, 23, 17, *coefficients)))
    lines = [f"{i} {model} 48 32 {numbers}" for i in range(1, 5)]
    cameras.write_text("\n".join(lines))
    lens = read(folder).cameras[0].lens

    assert (lens.fx, lens.fy, lens.cx, lens.cy) == (40, 40, 23, 17)
    assert lens.coefficients == coefficients
    assert lens.fisheye == model.endswith("FISHEYE")


@pytest.mark.parametrize("model", CAMERA_MODELS)
def test_a_lens_distorts_like_the_camera_of_colmap(model):
    camera = pycolmap.Camera(model=model, width=96, height=64, camera_id=1)
    camera.params = [0.01 * (i + 1) for i in range(len(camera.params_info.split(",")))]
    for indices, value in (
        (camera.focal_length_idxs(), 60.0),
        (camera.principal_point_idxs(), 40.0),
    ):
        for index in indices:
            camera.params[index] = value
    lens = make_lens("cam00", camera)

    for direction in ((0.4, 0.3), (-0.5, 0.2)):
        expected = camera.img_from_cam(np.array([*direction, 1.0]))
        assert lenses.distort(lens, *direction) == pytest.approx(tuple(expected))


def test_an_unsupported_lens_is_named_with_its_camera(folder, shots):
    rewrite_model(folder, shots, None, model="FOV", extra_params=(0.5,))

    with pytest.raises(
        UnsupportedCameraError, match=r"cam00 has the unsupported camera model FOV.*OPENCV_FISHEYE"
    ):
        read(folder)


def test_a_missing_picture_is_named_by_frame_and_camera(folder):
    (folder / "frames" / "0003" / "cam01.png").unlink()

    with pytest.raises(MissingCameraError, match=r"frames/0003 has no picture of camera cam01"):
        read(folder)


def test_a_jpeg_can_replace_a_png(folder, pictures):
    path = folder / "frames" / "0003" / "cam01.png"
    path.unlink()
    scenes.write_picture(path.with_suffix(".jpg"), pictures[1][3])
    difference = read(folder).source.read(1, 3).astype(int) - pictures[1][3]

    assert np.abs(difference).mean() < 8


def test_frames_are_counted_from_any_number_in_numeric_order(tmp_path, shots, pictures):
    scenes.write_model(tmp_path / "sparse", shots)
    for shot, row in zip(shots, pictures, strict=True):
        for frame, number in enumerate((8, 9, 10)):
            path = tmp_path / "frames" / f"{number}" / f"{shot.name}.png"
            scenes.write_picture(path, row[frame])
    footage = read(tmp_path)

    assert footage.frame_count == 3
    assert np.array_equal(footage.source.read(0, 2), pictures[0][2])


def test_a_gap_between_frames_is_rejected(folder):
    shutil.rmtree(folder / "frames" / "0002")

    with pytest.raises(CountMismatchError, match="between 0001 and 0003"):
        read(folder)


def test_missing_frames_are_named(folder):
    shutil.rmtree(folder / "frames")

    message = r"has poses for cameras cam00, .* no pictures of .*; looked for frames/0000/NAME.png"
    with pytest.raises(MissingFileError, match=message):
        read(folder)


@pytest.mark.parametrize("text", [False, True])
@pytest.mark.parametrize("name", ["cameras", "images", "points3D"])
def test_a_truncated_model_is_rejected_by_name(folder, shots, points, name, text):
    rewrite_model(folder, shots, points, text=text)
    path = folder / "sparse" / "0" / f"{name}.{'txt' if text else 'bin'}"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])

    with pytest.raises(UnreadablePoseError, match=r"sparse/0 is not a usable COLMAP model"):
        read(folder)


def test_a_model_without_images_is_rejected(folder):
    (folder / "sparse" / "0" / "images.bin").unlink()

    with pytest.raises(UnreadablePoseError, match=r"sparse/0 is not a usable COLMAP model"):
        read(folder)


def test_a_point_that_is_not_finite_is_rejected(folder, shots, points):
    positions = points.positions.copy()
    positions[3, 1] = np.inf
    rewrite_model(folder, shots, Points(positions, points.colors))

    with pytest.raises(UnreadablePoseError, match=r"1 of .* not finite, .* point 3 \("):
        read(folder)
