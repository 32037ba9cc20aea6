import re

import numpy as np
import pytest

from quarc_ref.datasets.video_writer import build_png
from quarc_ref.evaluation.comparison.entries import EntryError, Label
from quarc_ref.evaluation.comparison.renders import open_renders
from tests.encoder.toys import HEIGHT, WIDTH, make_cameras

LABEL = Label("method", "point")
PNG = build_png(np.zeros((16, 16, 3), np.uint8))


def write_pictures(folder, names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(PNG)


@pytest.mark.parametrize("pattern", ["cam{camera}/{frame:04}.png", "{frame:04}/cam{camera}.png"])
def test_hidden_files_are_not_pictures(tmp_path, pattern):
    names = [pattern.format(camera=camera, frame=frame) for camera in (0, 1) for frame in (3, 4)]
    write_pictures(tmp_path, names)
    write_pictures(tmp_path, [re.sub(r"/(?=[^/]*$)", "/._", name) for name in names])

    entry = open_renders(tmp_path, LABEL, ["cam0", "cam1"])

    assert entry.info.frames == (3, 4)


def test_only_frames_of_all_cameras_are_frames_of_an_entry(tmp_path):
    write_pictures(tmp_path, ["cam0/3.png", "cam0/4.png", "cam1/4.png", "cam1/5.png"])

    assert open_renders(tmp_path, LABEL, ["cam0", "cam1"]).info.frames == (4,)


@pytest.mark.parametrize("pattern", ["cam{camera}/3.png", "3/cam{camera}.png"])
def test_missing_cameras_are_named(tmp_path, pattern):
    write_pictures(tmp_path, [pattern.format(camera=camera) for camera in (0, 3)])

    with pytest.raises(EntryError, match=r"has pictures of cam0, but none of cam1, cam2$"):
        open_renders(tmp_path, LABEL, ["cam0", "cam1", "cam2"])


@pytest.mark.parametrize("pattern", ["cam0/0003", "0003/cam0"])
def test_two_files_of_one_picture_are_rejected(tmp_path, pattern):
    write_pictures(tmp_path, [f"{pattern}.png", f"{pattern}.jpg"])

    with pytest.raises(EntryError, match=r"same frame number|two pictures of cam0"):
        open_renders(tmp_path, LABEL, ["cam0"])


def test_transparent_pictures_are_put_on_black(tmp_path):
    (camera,) = make_cameras(1)
    levels = np.random.default_rng(0).integers(0, 256, (HEIGHT, WIDTH, 4), np.uint8)
    (tmp_path / "0000.png").write_bytes(build_png(levels))

    entry = open_renders(tmp_path, LABEL, [camera.name])
    picture = entry.render(0, {camera.name: camera})[camera.name]

    expected = levels[..., :3].astype(float) * levels[..., 3:] / 255**2
    assert np.allclose(picture, expected, atol=1e-6)


def test_a_picture_of_another_size_than_its_camera_is_rejected(tmp_path):
    (camera,) = make_cameras(1)
    write_pictures(tmp_path, ["0000.png"])  # as rendered for a stream of another --downscale
    entry = open_renders(tmp_path, LABEL, [camera.name])

    message = rf"0000\.png has 16 x 16 pixels, but .*compared at {WIDTH} x {HEIGHT}: render it"
    with pytest.raises(EntryError, match=message):
        entry.render(0, {camera.name: camera})
