"""Tests that masks of all layouts apply to the right frames and pixels in training."""

import json
import shutil

import numpy as np
import pytest

from quarc_ref.datasets.calibration import Lens
from quarc_ref.datasets.capture_notes import NOTES_NAME, CaptureNotes
from quarc_ref.datasets.errors import MaskCountError, MaskNameError, MaskSizeError
from quarc_ref.datasets.notes_file import write_capture_notes
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.datasets.undistortion import Rectifier
from tests.datasets.scenes import (
    make_picture_document,
    make_plane_points,
    make_shots,
    render,
    write_frames,
    write_model,
    write_picture,
    write_transforms,
    write_video,
)  # fmt: skip

FRAME_COUNT = 6


def _draw_mask(frame=0, size=(48, 32)):
    """Return a mask that is white up to column 20 + frame."""
    mask = np.zeros((size[1], size[0], 3), np.uint8)
    mask[:, : 20 + frame] = 255
    return mask


def _copy_capture(folder, tmp_path):
    return shutil.copytree(folder, tmp_path / "copy")


def _count_kept_columns(capture, camera, frame):
    return capture.mask(camera, frame).all(axis=0).sum()


def test_a_capture_without_masks_has_none(n3dv_folder):
    capture = open_capture(n3dv_folder)
    assert capture.masks is None
    assert capture.mask(0, 0) is None


def test_one_mask_applies_to_all_frames_of_its_camera(n3dv_folder, tmp_path):
    folder = _copy_capture(n3dv_folder, tmp_path)
    write_picture(folder / "masks" / "cam01.png", _draw_mask())
    capture = open_capture(folder)

    assert [_count_kept_columns(capture, 1, frame) for frame in (0, 5)] == [20, 20]
    assert capture.mask(0, 0) is None
    assert capture.findings == ()


def test_a_mask_named_after_the_picture_is_found(n3dv_folder, tmp_path):
    folder = _copy_capture(n3dv_folder, tmp_path)
    write_picture(folder / "masks" / "cam01.png.png", _draw_mask())
    assert _count_kept_columns(open_capture(folder), 1, 3) == 20


def test_masks_of_frames_follow_start_and_offsets(n3dv_folder, tmp_path):
    folder = _copy_capture(n3dv_folder, tmp_path)
    for frame in range(FRAME_COUNT):
        write_picture(folder / "masks" / "cam01" / f"{frame:04d}.png", _draw_mask(frame))
    write_capture_notes(folder / NOTES_NAME, CaptureNotes({"cam01": 2}))
    assert (
        _count_kept_columns(open_capture(folder, CaptureOptions(start=1)), 1, 1) == 20 + 2 + 1 + 1
    )


def test_a_video_of_masks_is_converted_back_to_black_and_white(n3dv_folder, tmp_path):
    folder = _copy_capture(n3dv_folder, tmp_path)
    (folder / "masks").mkdir()
    write_video(
        folder / "masks" / "cam01.mp4", [_draw_mask(2 * frame) for frame in range(FRAME_COUNT)]
    )
    capture = open_capture(folder)
    assert [_count_kept_columns(capture, 1, frame) for frame in (0, 2, 5)] == [20, 24, 30]


def test_transforms_name_their_masks(tmp_path):
    shots = make_shots()
    document = make_picture_document(shots, frame_count=2)
    for entry in document["frames"]:
        entry["mask_path"] = "masks/" + entry["file_path"]
    folder = write_transforms(tmp_path / "capture", document, make_plane_points())
    pictures = [[render(shot, frame_time) for frame_time in range(2)] for shot in shots]
    write_frames(folder, shots, pictures)
    masks = [[_draw_mask(7 * camera + frame) for frame in range(2)] for camera in range(len(shots))]
    write_frames(folder / "masks", shots, masks)
    capture = open_capture(folder)
    assert _count_kept_columns(capture, 3, 1) == 20 + 21 + 1


@pytest.mark.parametrize("masked_count", [1, 2])
def test_nerfstudio_masks_of_only_some_frames_are_rejected(tmp_path, masked_count):
    shots = make_shots()
    document = make_picture_document(shots, frame_count=3)
    for entry in document["frames"][:: len(shots)][:masked_count]:
        entry["mask_path"] = "mask.png"
    folder = write_transforms(tmp_path / "capture", document, make_plane_points())
    write_frames(folder, shots, [[render(shot)] * 3 for shot in shots])
    write_picture(folder / "mask.png", _draw_mask())

    with pytest.raises(MaskCountError, match=f"{masked_count} of the 3 entries of camera cam00"):
        open_capture(folder)


def test_a_colmap_project_has_masks_next_to_its_images(tmp_path):
    shots = make_shots()
    folder = tmp_path / "project"
    write_model(folder / "sparse" / "0", shots, make_plane_points())
    for shot in shots:
        write_picture(folder / "images" / f"{shot.name}.png", render(shot))
        write_picture(folder / "masks" / f"{shot.name}.png.png", _draw_mask())
    assert _count_kept_columns(open_capture(folder), 2, 0) == 20


def test_a_mask_changes_the_fingerprint(n3dv_folder, tmp_path):
    folder = _copy_capture(n3dv_folder, tmp_path)
    fingerprint_before = open_capture(folder).fingerprint
    write_picture(folder / "masks" / "cam01.png", _draw_mask())
    fingerprint_with_mask = open_capture(folder).fingerprint
    write_picture(folder / "masks" / "cam01.png", _draw_mask(1))
    assert len({fingerprint_before, fingerprint_with_mask, open_capture(folder).fingerprint}) == 3


def test_a_downscaled_pixel_counts_only_if_all_of_it_is_unmasked(n3dv_folder, tmp_path):
    folder = _copy_capture(n3dv_folder, tmp_path)
    write_picture(folder / "masks" / "cam01.png", _draw_mask(1))
    capture = open_capture(folder, CaptureOptions(downscale=2))
    assert capture.mask(1, 0).shape == (16, 24)
    assert _count_kept_columns(capture, 1, 0) == 10


def test_a_mask_is_undistorted_like_its_picture():
    rectifier = Rectifier(Lens(320, 240, 300.0, 300.0, 160.0, 120.0, (-0.2, 0.05)))
    y, x = np.mgrid[:240, :320]
    mask = np.sin(x / 9) * np.sin(y / 11) > 0
    rectified_picture = (
        rectifier.rectify(np.uint8(255 * mask)[..., None].repeat(3, axis=2))[..., 0] > 127
    )
    assert (rectifier.rectify_mask(mask) != rectified_picture).mean() < 0.001


def test_masks_without_a_camera_are_rejected(n3dv_folder, tmp_path):
    folder = _copy_capture(n3dv_folder, tmp_path)
    write_picture(folder / "masks" / "left.png", _draw_mask())
    with pytest.raises(MaskNameError, match=r"masks named left, .* such as cam00\.png"):
        open_capture(folder)


def test_a_mask_without_a_camera_is_found_among_others(n3dv_folder, tmp_path):
    folder = _copy_capture(n3dv_folder, tmp_path)
    for name in ("cam01.png", "cam03.png.png", "left.png"):
        write_picture(folder / "masks" / name, _draw_mask())
    capture = open_capture(folder)

    assert [_count_kept_columns(capture, camera, 0) for camera in (1, 2)] == [20, 20]
    (finding,) = capture.findings
    assert finding.kind == "mask-name"
    assert "masks named left," in finding.message


@pytest.mark.parametrize(
    ("count", "size", "error"),
    [(3, (48, 32), MaskCountError), (1, (24, 16), MaskSizeError)],
)
def test_masks_of_another_size_are_rejected(n3dv_folder, tmp_path, count, size, error):
    folder = _copy_capture(n3dv_folder, tmp_path)
    for frame in range(count):
        write_picture(folder / "masks" / "cam01" / f"{frame:04d}.png", _draw_mask(size=size))
    with pytest.raises(error, match="cam01"):
        open_capture(folder)


def test_a_named_mask_that_is_missing_is_rejected(tmp_path):
    shots = make_shots()
    document = make_picture_document(shots, frame_count=1)
    document["frames"][0]["mask_path"] = "nowhere.png"
    folder = write_transforms(tmp_path / "capture", document, make_plane_points())
    write_frames(folder, shots, [[render(shot)] for shot in shots])
    with pytest.raises(Exception, match=r"nowhere\.png"):
        open_capture(folder)
    assert json.loads((folder / "transforms.json").read_text())["frames"]
