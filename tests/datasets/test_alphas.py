"""Tests that masks and alpha channels separate a subject from a transparent background."""

import shutil

import cv2
import numpy as np
import pytest

from quarc_ref.datasets.capture_notes import NOTES_NAME, CaptureNotes
from quarc_ref.datasets.errors import CaptureError, MissingAlphaError
from quarc_ref.datasets.notes_file import write_capture_notes
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.datasets.stills import read_still_alpha
from tests.datasets.scenes import (
    make_plane_points,
    make_shots,
    render,
    write_model,
    write_n3dv,
    write_picture,
    write_video,
)

FRAME_COUNT = 6
TRANSPARENT = CaptureNotes(has_transparent_background=True)


def _draw_levels(frame=0):
    """Return alpha that is 255 up to column 30, then 128 in 2 + frame columns, then 0."""
    levels = np.zeros((32, 48), np.uint8)
    levels[:, :30] = 255
    levels[:, 30 : 32 + frame] = 128
    return levels


def _write_masks(folder, camera_names, frame_count=FRAME_COUNT):
    for name in camera_names:
        for frame in range(frame_count):
            mask = _draw_levels(frame)[..., None].repeat(3, axis=2)
            write_picture(folder / "masks" / name / f"{frame:04d}.png", mask)


@pytest.fixture
def masked_folder(n3dv_folder, tmp_path, shots):
    """A capture with a transparent background and a gray mask for every frame."""
    folder = shutil.copytree(n3dv_folder, tmp_path / "masked")
    _write_masks(folder, [shot.name for shot in shots])
    write_capture_notes(folder / NOTES_NAME, TRANSPARENT)
    return folder


@pytest.fixture
def rgba_folder(tmp_path):
    """A COLMAP project with alpha channels."""
    shots, folder = make_shots(), tmp_path / "rgba"
    write_model(folder / "sparse" / "0", shots, make_plane_points())
    (folder / "images").mkdir()
    for shot in shots:
        picture = np.dstack([render(shot)[..., ::-1], _draw_levels()])
        assert cv2.imwrite(str(folder / "images" / f"{shot.name}.png"), picture)
    return folder


def test_masks_are_the_alpha_of_the_pictures(masked_folder, n3dv_folder):
    capture, opaque_capture = open_capture(masked_folder), open_capture(n3dv_folder)

    assert np.array_equal(capture.alpha(1, 3), _draw_levels(3))
    weighted = opaque_capture.image(1, 3) * (_draw_levels(3)[..., None] / 255)
    assert np.array_equal(capture.image(1, 3), np.round(weighted))
    assert capture.mask(1, 3) is None
    assert opaque_capture.alpha(1, 3) is None
    assert capture.fingerprint != opaque_capture.fingerprint


def test_alpha_follows_start_and_offsets(masked_folder):
    write_capture_notes(
        masked_folder / NOTES_NAME, CaptureNotes({"cam01": 2}, has_transparent_background=True)
    )
    capture = open_capture(masked_folder, CaptureOptions(start=1))
    assert np.array_equal(capture.alpha(1, 1), _draw_levels(2 + 1 + 1))
    assert np.array_equal(capture.alpha(0, 1), _draw_levels(1 + 1))


def test_a_downscaled_pixel_has_the_mean_alpha_and_no_light_of_the_background(masked_folder):
    masks = sorted((masked_folder / "masks" / "cam01").iterdir())
    write_picture(masks[0], np.where(np.arange(48) < 21, 255, 0)[None, :, None].repeat(32, 0))

    capture = open_capture(masked_folder, CaptureOptions(downscale=2))
    stored = capture.stored_pictures.read(1, 0).astype(float)

    assert capture.alpha(1, 0).shape == (16, 24)
    assert capture.alpha(1, 0)[0, 9:12].tolist() == [255, 128, 0]
    half = capture.image(1, 0)[:, 10].astype(float)
    assert np.abs(half - stored[:, 20].reshape(16, 2, 3).mean(axis=1) / 2).max() <= 1


def test_the_gray_levels_of_a_video_keep_black_and_white(masked_folder):
    shutil.rmtree(masked_folder / "masks" / "cam01")
    mask_video = masked_folder / "masks" / "cam01.mp4"
    write_video(mask_video, [_draw_levels(f)[..., None].repeat(3, 2) for f in range(FRAME_COUNT)])

    alpha = open_capture(masked_folder).alpha(1, 5)

    assert (alpha[:, :28] == 255).all()
    assert (alpha[:, 40:] == 0).all()
    assert np.abs(alpha[:, 32:35].astype(int) - 128).max() < 16


def test_alpha_channels_are_used_without_masks(rgba_folder):
    write_capture_notes(rgba_folder / NOTES_NAME, TRANSPARENT)
    capture = open_capture(rgba_folder)
    assert np.array_equal(capture.alpha(2, 0), _draw_levels())
    assert (capture.image(2, 0)[:, 32:] == 0).all()
    assert capture.findings == ()


def test_a_capture_that_does_not_use_its_alpha_channels_is_told_how_to(rgba_folder):
    opaque = np.zeros((32, 48, 3), np.uint8)
    write_picture(rgba_folder / "images" / "cam00.png", opaque)  # held out, so it is not read
    (finding,) = open_capture(rgba_folder).findings
    assert finding.kind == "transparency-ignored"
    assert '{"background": "transparent"}' in finding.message

    write_picture(rgba_folder / "masks" / "cam00.png", np.full((32, 48, 3), 255, np.uint8))
    assert open_capture(rgba_folder).findings == ()


def test_a_video_of_one_frame_has_no_alpha_channel(tmp_path):
    folder = write_n3dv(tmp_path / "one", make_shots(), frame_count=1, points=make_plane_points())
    assert open_capture(folder).findings == ()
    write_capture_notes(folder / NOTES_NAME, TRANSPARENT)
    with pytest.raises(MissingAlphaError, match="camera cam01 has no mask"):
        open_capture(folder)


def test_a_camera_without_alpha_is_named(masked_folder, rgba_folder):
    shutil.rmtree(masked_folder / "masks" / "cam01")
    with pytest.raises(MissingAlphaError, match="camera cam01 has no mask"):
        open_capture(masked_folder)

    write_capture_notes(rgba_folder / NOTES_NAME, TRANSPARENT)
    write_picture(rgba_folder / "images" / "cam03.png", np.zeros((32, 48, 3), np.uint8))
    with pytest.raises(MissingAlphaError, match="camera cam03"):
        open_capture(rgba_folder)


def test_alpha_of_another_size_in_a_later_frame_is_an_error(masked_folder):
    small = np.full((16, 24, 3), 255, np.uint8)
    write_picture(masked_folder / "masks" / "cam00" / "0004.png", small)
    capture = open_capture(masked_folder)
    with pytest.raises(CaptureError, match="24x16"):
        capture.image(0, 4)


def test_alpha_with_16_bits_is_rounded(tmp_path):
    levels = np.random.default_rng(0).integers(0, 65536, (32, 48, 4)).astype(np.uint16)
    levels[:4, :, 3] = np.arange(4 * 48).reshape(4, 48)  # below half of a level, or just above
    cv2.imwrite(str(tmp_path / "deep.png"), levels)
    alpha = read_still_alpha(tmp_path / "deep.png")
    assert np.array_equal(alpha, np.rint(levels[..., 3] / 257))


@pytest.mark.parametrize("channels", [1, 3])
def test_a_picture_without_an_alpha_channel_has_no_alpha(tmp_path, channels):
    cv2.imwrite(str(tmp_path / "a.png"), np.zeros((8, 8, channels), np.uint8))
    assert read_still_alpha(tmp_path / "a.png") is None
