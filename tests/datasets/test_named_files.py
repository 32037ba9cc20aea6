"""Allowed and forbidden names in `transforms.json`: files outside its folder are forbidden."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from quarc_ref.datasets.errors import CaptureError, MissingFileError, OutsideFileError
from quarc_ref.datasets.layouts.transforms_json import read_nerfstudio
from quarc_ref.datasets.named_files import NamedFiles
from tests.datasets import scenes


@pytest.fixture
def layout(tmp_path, n3dv_folder, shots, pictures, points):
    """A folder with a capture of videos, one of pictures, and the same files next to them."""
    videos, stills = tmp_path / "videos", tmp_path / "stills"
    shutil.copytree(n3dv_folder, videos)
    scenes.write_frames(stills, shots, pictures)
    for folder in (videos, stills):
        scenes.write_transforms(folder, {}, points)
    shutil.copy(videos / "cam00.mp4", tmp_path)
    shutil.copy(videos / "points.ply", tmp_path)
    shutil.copy(stills / "frames" / "0000" / "cam00.png", tmp_path)
    return tmp_path


def _describe_video(layout, shots, name):
    document = scenes.video_document(shots)
    document["frames"][0]["file_path"] = name
    return scenes.write_transforms(layout / "videos", document)


def _describe_picture(layout, shots, name):
    document = scenes.picture_document(shots)
    document["frames"][-4]["file_path"] = name
    return scenes.write_transforms(layout / "stills", document)


def _describe_points(layout, shots, name):
    return scenes.write_transforms(
        layout / "videos", scenes.video_document(shots, ply_file_path=name)
    )


KINDS = {
    "cam00.mp4": _describe_video,
    "cam00.png": _describe_picture,
    "points.ply": _describe_points,
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("way", ["../{}", "frames/../../{}", "{above}/{}", "link/{}", "linked_{}"])
def test_a_file_outside_the_folder_is_rejected_by_name(layout, shots, kind, way):
    name = way.format(kind, above=layout)
    folder = KINDS[kind](layout, shots, name)
    (folder / "frames").mkdir(exist_ok=True)
    (folder / "link").symlink_to(layout, target_is_directory=True)
    (folder / f"linked_{kind}").symlink_to(layout / kind)

    with pytest.raises(OutsideFileError) as error_info:
        read_nerfstudio(folder)
    assert f"transforms.json names {name}, which is outside its folder" in str(error_info.value)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "name", ["C:\\Windows\\{}", "C:{}", "\\\\host\\share\\{}", "..\\{}", "a\0{}", "\ud800{}", "{}/"]
)
def test_an_invalid_file_name_is_rejected_by_name(layout, shots, kind, name):
    folder = KINDS[kind](layout, shots, name.format(f"no_{kind}"))

    with pytest.raises(CaptureError, match=f"transforms.json names.*no_{kind}|no_{kind}.*names"):
        read_nerfstudio(folder)


@pytest.mark.parametrize("kind", KINDS)
def test_links_in_a_circle_are_rejected_by_name(layout, shots, kind):
    folder = KINDS[kind](layout, shots, f"here_{kind}")
    (folder / f"here_{kind}").symlink_to("there")
    (folder / "there").symlink_to(f"here_{kind}")

    with pytest.raises(CaptureError, match=f"here_{kind}"):
        read_nerfstudio(folder)


def test_paths_within_the_folder_can_be_written_in_any_way(layout, shots, pictures):
    folder = layout / "videos"
    document = scenes.video_document(shots, ply_file_path=str(folder / "points.ply"))
    names = ["./cam00.mp4", str(folder / "cam01.mp4"), "frames/../cam03.mp4", "linked.mp4"]
    for frame, name in zip(document["frames"], names, strict=True):
        frame["file_path"] = name
    (folder / "frames").mkdir()
    (folder / "linked.mp4").symlink_to("cam04.mp4")
    footage = read_nerfstudio(scenes.write_transforms(folder, document))

    assert np.array_equal(footage.source.read(3, 2), pictures[3][2])
    assert len(footage.points.positions) == 200


def test_a_folder_reached_by_a_link_or_from_within_is_read(layout, shots, monkeypatch):
    scenes.write_transforms(layout / "videos", scenes.video_document(shots))
    (layout / "link").symlink_to(layout / "videos")
    monkeypatch.chdir(layout / "videos")

    for folder in (layout / "link", Path(), Path("../videos"), Path("../link")):
        assert read_nerfstudio(folder).frame_count == 6


def test_a_missing_folder_or_file_is_reported_as_missing(tmp_path):
    (tmp_path / "folder").mkdir()
    named = NamedFiles(tmp_path / "transforms.json")

    for name in ("folder", "nothing", ".", "", "x" * 5000):
        with pytest.raises(MissingFileError, match="missing or not a regular file"):
            named.find(name)
