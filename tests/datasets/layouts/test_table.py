"""Every layout gives the capture that it was built from."""

import shutil

import numpy as np
import pytest

from quarc_ref.calibration.recordings import find_recordings
from quarc_ref.datasets.capture_notes import NOTES_NAME, CaptureNotes
from quarc_ref.datasets.errors import (
    CountMismatchError,
    MissingCameraError,
    MissingFileError,
    UnknownLayoutError,
)
from quarc_ref.datasets.layouts.table import LAYOUTS, choose_layout
from quarc_ref.datasets.notes_file import write_capture_notes
from quarc_ref.datasets.open_capture import open_capture
from tests.datasets.layouts.builders import BUILDERS, write_model, write_poses

JPEG_LEVELS = 1.0  # of 255, by which JPEG changes pictures on average


@pytest.fixture(scope="session")
def built(traced_capture, tmp_path_factory):
    """Builds each layout once."""
    root, folders = tmp_path_factory.mktemp("built"), {}

    def build(name):
        if name not in folders:
            folders[name] = root / name
            BUILDERS[name](traced_capture, root / name)
        return folders[name]

    return build


def read(folder):
    return choose_layout(folder).read(folder)


@pytest.mark.parametrize("name", BUILDERS)
def test_a_layout_has_the_poses_it_was_built_from(traced_capture, built, name):
    footage = read(built(name))

    assert len(footage.cameras) == 4
    for found, camera in zip(footage.cameras, traced_capture.capture.cameras, strict=True):
        lens = found.lens
        expected = (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
        assert (lens.width, lens.height, lens.fx, lens.fy, lens.cx, lens.cy) == pytest.approx(
            expected
        )
        assert found.pose.rotation.ravel() == pytest.approx(camera.rotation, abs=1e-6)
        assert found.pose.translation == pytest.approx(camera.translation, abs=1e-5)


@pytest.mark.parametrize("name", BUILDERS)
def test_a_layout_has_the_pictures_it_was_built_from(traced_capture, built, name):
    footage = read(built(name))

    assert footage.source.lengths == ((1,) * 4 if name == "colmap_project" else (3,) * 4)
    for camera, row in enumerate(traced_capture.pictures):
        for frame in range(footage.frame_count):
            difference = footage.source.read(camera, frame).astype(int) - row[frame]
            is_jpeg = footage.source.paths[camera][0].suffix == ".jpg"
            assert np.abs(difference).mean() <= (JPEG_LEVELS if is_jpeg else 0)


@pytest.mark.parametrize("name", BUILDERS)
def test_a_layout_has_the_points_it_can_hold(traced_capture, built, name):
    points = read(built(name)).points

    if name.startswith(("easymocap", "panoptic")):
        assert points is None
    else:
        assert np.array_equal(points.positions, traced_capture.capture.points.positions)
        assert np.array_equal(points.colors, traced_capture.capture.points.colors)


def test_cameras_are_in_natural_order(traced_capture, tmp_path):
    traced_capture.copy_videos(tmp_path, "cam_{index}.mp4")
    for index in (2, 3):
        (tmp_path / f"cam_{index}.mp4").rename(tmp_path / f"cam_{index + 8}.mp4")
    write_poses(traced_capture, tmp_path)
    footage = read(tmp_path)

    assert [camera.name for camera in footage.cameras] == ["cam_0", "cam_1", "cam_10", "cam_11"]
    assert footage.findings == ()


def test_every_layout_is_listed_with_what_is_missing(tmp_path):
    (tmp_path / "intri.yml").touch()
    with pytest.raises(UnknownLayoutError) as error_info:
        read(tmp_path)

    message = str(error_info.value)
    for layout in LAYOUTS:
        assert layout.name in message
    assert "N3DV, DyNeRF, MeetRoom with poses (poses_bounds.npy)" in message
    assert "EasyMocap, ENeRF (extri.yml)" in message
    assert "intri.yml" not in message


@pytest.mark.parametrize("subfolder", ["", "videos"])
def test_for_videos_without_poses_calibrate_is_suggested(traced_capture, tmp_path, subfolder):
    (tmp_path / subfolder).mkdir(exist_ok=True)
    traced_capture.copy_videos(tmp_path / subfolder)

    with pytest.raises(
        UnknownLayoutError,
        match=r"4 videos without poses; .* quarc-ref calibrate",
    ):
        read(tmp_path)


def test_a_capture_one_folder_down_is_named(traced_capture, tmp_path):
    shutil.copytree(traced_capture.folder, tmp_path / "steak")

    with pytest.raises(UnknownLayoutError, match=r"Its subfolder steak is a capture: use .*steak"):
        read(tmp_path)


def test_a_camera_without_pictures_is_named(built, tmp_path):
    folder = shutil.copytree(built("colmap_videos"), tmp_path / "copy")
    (folder / "cam02.mp4").unlink()

    with pytest.raises(MissingCameraError, match=r"of cam02, but no pictures, such as cam02.mp4:"):
        read(folder)


@pytest.mark.parametrize(
    ("name", "video"),
    [
        ("colmap_videos", "cam07.mp4"),
        ("easymocap_videos", "videos/cam07.mp4"),
        ("panoptic_videos", "hdVideos/hd_cam07.mp4"),
    ],
)
def test_a_video_without_a_pose_is_named(name, video, built, tmp_path):
    folder = shutil.copytree(built(name), tmp_path / "copy")
    assert "camera-without-pose" not in {finding.kind for finding in read(folder).findings}
    shutil.copy(next((folder / video).parent.glob("*.mp4")), folder / video)

    (finding,) = (found for found in read(folder).findings if found.kind == "camera-without-pose")
    assert finding.message.startswith("recordings of cam07 have no poses in ")


def test_of_a_camera_without_pictures_the_file_that_cannot_be_read_is_named(built, tmp_path):
    folder = shutil.copytree(built("colmap_videos"), tmp_path / "copy")
    (folder / "cam02.mp4").rename(folder / "cam02.avi")

    with pytest.raises(MissingCameraError, match=r"Files such as cam02.avi cannot be read"):
        read(folder)


def test_for_poses_without_pictures_the_searched_places_are_named(traced_capture, tmp_path):
    write_model(traced_capture, tmp_path)

    with pytest.raises(MissingFileError, match=r"cameras cam00, .*frames/0000/NAME.png.*images/"):
        read(tmp_path)


def test_for_poses_of_other_names_the_recordings_are_named(traced_capture, tmp_path):
    write_model(traced_capture, tmp_path)
    traced_capture.copy_videos(tmp_path, "GOPR{index}.mp4")

    with pytest.raises(MissingFileError, match=r"There are recordings of GOPR0, .* \(NAME.mp4\)"):
        read(tmp_path)


def test_the_folder_of_masks_is_no_camera(traced_capture, tmp_path):
    write_poses(traced_capture, tmp_path)
    traced_capture.write_stills(tmp_path, "{index:02d}/{frame:04d}.png")
    traced_capture.write_stills(tmp_path, "masks/{index:02d}.png", 1)

    assert [camera.name for camera in read(tmp_path).cameras] == ["00", "01", "02", "03"]
    assert find_recordings(tmp_path).names == ("00", "01", "02", "03")


def test_a_hidden_folder_is_no_camera(traced_capture, tmp_path):
    write_poses(traced_capture, tmp_path)
    traced_capture.write_stills(tmp_path, "{index:02d}/{frame:04d}.png")
    traced_capture.write_stills(tmp_path, ".thumbnails/{index:02d}.png", 1)

    assert [camera.name for camera in read(tmp_path).cameras] == ["00", "01", "02", "03"]


@pytest.mark.parametrize("pattern", ["frames/0000/cam01.png", "cam01/0000.png"])
@pytest.mark.parametrize("frame_count", [1, 3])
def test_two_files_of_one_picture_are_rejected(traced_capture, tmp_path, pattern, frame_count):
    write_poses(traced_capture, tmp_path)
    capture_pattern = pattern.replace("0000", "{frame:04d}").replace("cam01", "{name}")
    traced_capture.write_stills(tmp_path, capture_pattern, frame_count)
    (tmp_path / pattern).with_suffix(".jpg").write_bytes((tmp_path / pattern).read_bytes())

    with pytest.raises(CountMismatchError, match=r"two pictures of the same frame, (\w+).jpg and"):
        read(tmp_path)


@pytest.mark.parametrize("pattern", ["{name}.mp4", "images/{name}.png"])
def test_two_files_of_one_camera_are_rejected(traced_capture, tmp_path, pattern):
    write_poses(traced_capture, tmp_path)
    for name in ("cam00", "cam01", "cam02", "cam03"):
        path = tmp_path / pattern.format(name=name)
        path.parent.mkdir(exist_ok=True)
        path.touch()
    other_suffix = {".mp4": ".mov", ".png": ".jpg"}[path.suffix]
    path.with_suffix(other_suffix).touch()

    with pytest.raises(CountMismatchError, match=r"two files of camera cam03, cam03.\w+ and cam03"):
        read(tmp_path)


@pytest.mark.parametrize(
    "name",
    ["n3dv_picture_folders", "colmap_folders", "easymocap", "panoptic_pictures"],
)
def test_a_camera_that_lacks_its_first_picture_is_named(built, tmp_path, name):
    folder = shutil.copytree(built(name), tmp_path / "copy")
    footage = read(folder)
    camera, (first_path, *_) = footage.cameras[1].name, footage.source.paths[1]
    first_path.unlink()

    (finding,) = read(folder).findings
    assert (finding.kind, finding.cameras) == ("frame-numbers", (camera,))
    assert f"{camera} begin with number 1, and those of other cameras with 0" in finding.message
    assert f'("offsets": {{"{camera}": -1}})' in finding.message
    assert footage.findings == ()


def test_offsets_resolve_a_finding_about_numbers(built, tmp_path):
    folder = shutil.copytree(built("n3dv_picture_folders"), tmp_path / "copy")
    (folder / "cam01" / "0000.png").unlink()
    kinds = [finding.kind for finding in open_capture(folder).findings]
    write_capture_notes(folder / NOTES_NAME, CaptureNotes({"cam01": -1}))
    resolved_capture = open_capture(folder)

    assert "frame-numbers" in kinds
    assert resolved_capture.findings == ()
    assert resolved_capture.full_capture.frame_count == len(read(folder).source.paths[1])


def test_a_gap_among_the_pictures_of_a_camera_is_named(built, tmp_path):
    folder = shutil.copytree(built("n3dv_picture_folders"), tmp_path / "copy")
    (folder / "cam01" / "0003.png").write_bytes((folder / "cam01" / "0000.png").read_bytes())
    (folder / "cam01" / "0001.png").unlink()

    with pytest.raises(CountMismatchError, match=r"cam01 has no frames between 0000 and 0002"):
        read(folder)


@pytest.mark.parametrize("name", ["n3dv", "colmap_videos"])
def test_a_folder_of_single_frames_beside_complete_videos_does_not_matter(name, built, tmp_path):
    folder = shutil.copytree(built(name), tmp_path / "copy")
    for frame in ("0000", "0030", "0100"):
        (folder / "frames" / frame).mkdir(parents=True)
        (folder / "frames" / frame / "preview.png").touch()

    assert read(folder).frame_count == read(built(name)).frame_count


@pytest.mark.parametrize("key", ["dist", "D"])
def test_the_lenses_of_easymocap_have_their_distortion(key, built, tmp_path):
    folder = shutil.copytree(built("easymocap_videos"), tmp_path / "copy")
    text = (folder / "intri.yml").read_text()
    assert text.count("[ 0., 0., 0., 0., 0. ]") == 4
    text = text.replace("[ 0., 0., 0., 0., 0. ]", "[ 0.1, -0.02, 0.003, 0.004, 0. ]")
    (folder / "intri.yml").write_text(text.replace("dist_", f"{key}_"))

    for camera in read(folder).cameras:
        assert camera.lens.coefficients == (0.1, -0.02, 0.003, 0.004, 0)


def test_the_lenses_of_the_panoptic_studio_have_their_distortion(built, tmp_path):
    folder = shutil.copytree(built("panoptic_videos"), tmp_path / "copy")
    path = folder / "calibration_room.json"
    text = path.read_text().replace("[0, 0, 0, 0, 0]", "[-0.1, 0.02, 0.003, 0.004, 0.005]")
    path.write_text(text)

    for camera in read(folder).cameras:
        assert camera.lens.coefficients == (-0.1, 0.02, 0.003, 0.004, 0.005)


def test_without_hd_recordings_the_vga_cameras_of_the_panoptic_studio_are_used(built, tmp_path):
    folder = shutil.copytree(built("panoptic_videos"), tmp_path / "copy")
    (folder / "vgaVideos").mkdir()
    (folder / "hdVideos" / "hd_00_01.mp4").rename(folder / "vgaVideos" / "vga_01_01.mp4")
    hd_names = [camera.name for camera in read(folder).cameras]
    shutil.rmtree(folder / "hdVideos")

    assert hd_names == ["00_00", "00_02", "00_03"]
    assert [camera.name for camera in read(folder).cameras] == ["01_01"]


def test_of_the_panoptic_studio_only_cameras_with_pictures_are_used(built):
    names = [camera.name for camera in read(built("panoptic_videos")).cameras]

    assert names == ["00_00", "00_01", "00_02", "00_03"]
