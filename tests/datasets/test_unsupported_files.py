"""Errors about missing recordings name files that cannot be read."""

import shutil

import numpy as np
import pytest

from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.recordings import find_recordings
from quarc_ref.datasets.errors import MissingFileError, UnknownLayoutError
from quarc_ref.datasets.layouts.n3dv import read_n3dv
from quarc_ref.datasets.layouts.table import choose_layout
from quarc_ref.datasets.nested_videos import describe_nested_videos
from quarc_ref.datasets.unsupported_files import describe_unsupported_files
from tests.datasets import scenes

NAMES = ["cam00.AVI", "cam00.h264", "cam00.360", "cam00/0000.webp", "images/cam00/0000.tif"]


def add_file(folder, name):
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(b"x")


@pytest.mark.parametrize("name", NAMES)
def test_recordings_that_cannot_be_read_are_named(tmp_path, name):
    add_file(tmp_path, name)
    message = f"Files such as {name} cannot be read: convert videos to mp4, and pictures to PNG"

    with pytest.raises(CalibrationError, match=message):
        find_recordings(tmp_path)
    with pytest.raises(UnknownLayoutError, match=message):
        choose_layout(tmp_path)
    np.save(tmp_path / "poses_bounds.npy", scenes.make_poses_row(scenes.make_shots()[0])[None])
    with pytest.raises(MissingFileError, match=message):
        read_n3dv(tmp_path)


@pytest.mark.parametrize("name", ["GX01.MP4", "DCIM/GX01.MP4", "DCIM/100GOPRO/GX01.MP4"])
def test_videos_in_a_folder_for_each_camera_are_named(tmp_path, name):
    for folder in ("cam00", "cam01", "cam02", ".trash"):
        add_file(tmp_path, f"{folder}/{name}")
    message = rf"cam00/{name} is in a folder of its own: .*, with names such as cam00.MP4$"

    with pytest.raises(CalibrationError, match=message):
        find_recordings(tmp_path)
    with pytest.raises(UnknownLayoutError, match=message):
        choose_layout(tmp_path)
    shutil.rmtree(tmp_path / "cam00")
    shutil.rmtree(tmp_path / "cam01")
    assert describe_nested_videos(tmp_path) == ""


def test_parts_of_recordings_in_a_folder_for_each_camera_are_to_be_joined(tmp_path):
    for camera in range(4):
        for part in (1, 2):
            add_file(tmp_path, f"cam{camera:02d}/GX0{part}0001.MP4")

    with pytest.raises(CalibrationError, match=r"are parts of one recording, join them first"):
        find_recordings(tmp_path)


def test_a_folder_with_all_videos_is_named(tmp_path):
    for name in ("cam00.mp4", "cam01.mp4", "cam02.mp4"):
        add_file(tmp_path, f"DCIM/100MEDIA/{name}")

    with pytest.raises(CalibrationError, match=r"3 videos in .*DCIM/100MEDIA: use that folder$"):
        find_recordings(tmp_path)


@pytest.mark.parametrize("name", ["cam00.mp4", "cam01", "images/cam00/0000.png"])
def test_broken_links_are_named(tmp_path, name):
    (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / name).symlink_to(tmp_path / "nas" / "cam00.mp4")

    with pytest.raises(CalibrationError, match=rf"{name} is a broken link"):
        find_recordings(tmp_path)


def test_hidden_files_and_known_formats_are_not_named(tmp_path):
    for name in ("cam00.mp4", "cam01/0000.png", ".cam02.avi", "notes.txt"):
        add_file(tmp_path, name)
    (tmp_path / "cam03.mp4").symlink_to("cam00.mp4")
    (tmp_path / ".cam04.mp4").symlink_to("missing.mp4")

    assert describe_unsupported_files(tmp_path) == ""
