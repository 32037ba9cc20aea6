"""Tests of file names in `transforms.json`, which must be inside the folder of the capture."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from quarc_ref.datasets.errors import CaptureError, MissingFileError, OutsideFileError
from quarc_ref.datasets.layouts.transforms_json import read_nerfstudio
from quarc_ref.datasets.named_files import NamedFileResolver
from tests.datasets import scenes


@pytest.fixture
def capture_folders(tmp_path, n3dv_folder, shots, pictures, points):
    """A folder with a capture of videos, a capture of pictures, and copies of three files."""
    videos, stills = tmp_path / "videos", tmp_path / "stills"
    shutil.copytree(n3dv_folder, videos)
    scenes.write_frames(stills, shots, pictures)
    for folder in (videos, stills):
        scenes.write_transforms(folder, {}, points)
    shutil.copy(videos / "cam00.mp4", tmp_path)
    shutil.copy(videos / "points.ply", tmp_path)
    shutil.copy(stills / "frames" / "0000" / "cam00.png", tmp_path)
    return tmp_path


def _describe_video(capture_folders, shots, name):
    document = scenes.make_video_document(shots)
    document["frames"][0]["file_path"] = name
    return scenes.write_transforms(capture_folders / "videos", document)


def _describe_picture(capture_folders, shots, name):
    document = scenes.make_picture_document(shots)
    document["frames"][-4]["file_path"] = name
    return scenes.write_transforms(capture_folders / "stills", document)


def _describe_points(capture_folders, shots, name):
    return scenes.write_transforms(
        capture_folders / "videos", scenes.make_video_document(shots, ply_file_path=name)
    )


WRITERS_BY_FILE = {
    "cam00.mp4": _describe_video,
    "cam00.png": _describe_picture,
    "points.ply": _describe_points,
}


@pytest.mark.parametrize("file_name", WRITERS_BY_FILE)
@pytest.mark.parametrize(
    "pattern", ["../{}", "frames/../../{}", "{above}/{}", "link/{}", "linked_{}"]
)
def test_a_file_outside_the_folder_is_rejected_by_name(capture_folders, shots, file_name, pattern):
    name = pattern.format(file_name, above=capture_folders)
    folder = WRITERS_BY_FILE[file_name](capture_folders, shots, name)
    (folder / "frames").mkdir(exist_ok=True)
    (folder / "link").symlink_to(capture_folders, target_is_directory=True)
    (folder / f"linked_{file_name}").symlink_to(capture_folders / file_name)

    with pytest.raises(OutsideFileError) as error_info:
        read_nerfstudio(folder)
    remedy = ", behind a link: replace" if "link" in pattern else ": move the file into the folder"
    message = f"transforms.json names {name}, which is outside its folder{remedy}"
    assert message in str(error_info.value)


@pytest.mark.parametrize("file_name", WRITERS_BY_FILE)
@pytest.mark.parametrize(
    "name", ["C:\\Windows\\{}", "C:{}", "\\\\host\\share\\{}", "..\\{}", "a\0{}", "\ud800{}", "{}/"]
)
def test_an_invalid_file_name_is_rejected_by_name(capture_folders, shots, file_name, name):
    folder = WRITERS_BY_FILE[file_name](capture_folders, shots, name.format(f"no_{file_name}"))

    with pytest.raises(
        CaptureError, match=f"transforms.json names.*no_{file_name}|no_{file_name}.*names"
    ):
        read_nerfstudio(folder)


@pytest.mark.parametrize("file_name", WRITERS_BY_FILE)
def test_links_in_a_circle_are_rejected_by_name(capture_folders, shots, file_name):
    folder = WRITERS_BY_FILE[file_name](capture_folders, shots, f"here_{file_name}")
    (folder / f"here_{file_name}").symlink_to("there")
    (folder / "there").symlink_to(f"here_{file_name}")

    with pytest.raises(CaptureError, match=f"here_{file_name}"):
        read_nerfstudio(folder)


def test_paths_within_the_folder_can_be_written_in_any_way(capture_folders, shots, pictures):
    folder = capture_folders / "videos"
    document = scenes.make_video_document(shots, ply_file_path=str(folder / "points.ply"))
    names = ["./cam00.mp4", str(folder / "cam01.mp4"), "frames/../cam03.mp4", "linked.mp4"]
    for entry, name in zip(document["frames"], names, strict=True):
        entry["file_path"] = name
    (folder / "frames").mkdir()
    (folder / "linked.mp4").symlink_to("cam04.mp4")
    footage = read_nerfstudio(scenes.write_transforms(folder, document))

    assert np.array_equal(footage.source.read(3, 2), pictures[3][2])
    assert len(footage.points.positions) == 200


def test_a_folder_reached_by_a_link_or_from_within_is_read(capture_folders, shots, monkeypatch):
    scenes.write_transforms(capture_folders / "videos", scenes.make_video_document(shots))
    (capture_folders / "link").symlink_to(capture_folders / "videos")
    monkeypatch.chdir(capture_folders / "videos")

    for folder in (capture_folders / "link", Path(), Path("../videos"), Path("../link")):
        assert read_nerfstudio(folder).frame_count == 6


def test_a_missing_folder_or_file_is_reported_as_missing(tmp_path):
    (tmp_path / "folder").mkdir()
    named_files = NamedFileResolver(tmp_path / "transforms.json")

    for name in ("folder", "nothing", ".", "", "x" * 5000):
        with pytest.raises(MissingFileError, match="missing or not a regular file"):
            named_files.find(name)
