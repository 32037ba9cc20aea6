"""Options of `calibrate`: masks, known lenses, separate lenses, pictures."""

import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest

from quarc_ref.calibration.calibrate import CalibrateOptions, calibrate
from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.features import Features
from quarc_ref.calibration.lenses import LensOptions, read_lenses
from quarc_ref.calibration.masks import read_masks
from quarc_ref.calibration.offsets import SyncMethod
from quarc_ref.calibration.recordings import find_recordings
from quarc_ref.calibration.write_capture import write_capture
from quarc_ref.datasets.errors import MaskNameError, MaskSizeError
from quarc_ref.files import written_folder
from tests.calibration.rigs import measure_pose_errors

CAMERA_COUNT = 5


@pytest.fixture(scope="module")
def picture_folder(traced_rig, tmp_path_factory):
    """A folder with the pictures of neighboring cameras, one subfolder per camera."""
    folder = tmp_path_factory.mktemp("few")
    recordings = find_recordings(traced_rig.folder)
    for index, name in enumerate(recordings.names[:CAMERA_COUNT]):
        (folder / name).mkdir()
        picture = recordings.pictures.read(index, 0)
        assert cv2.imwrite(str(folder / name / "0000.png"), picture[..., ::-1])
    return folder


def test_a_folder_of_single_frames_beside_recordings_does_not_matter(picture_folder, tmp_path):
    folder = shutil.copytree(picture_folder, tmp_path / "copy")
    for frame in ("0000", "0030", "0100"):
        (folder / "frames" / frame).mkdir(parents=True)
        (folder / "frames" / frame / "preview.png").touch()

    assert find_recordings(folder).names == find_recordings(picture_folder).names


@pytest.fixture(scope="module")
def shared_lens_rig(picture_folder):
    return _calibrate(picture_folder)


def _calibrate(folder, lenses=None, **options_by_name):
    options = CalibrateOptions(
        lenses or LensOptions(), sync=SyncMethod.NONE, moment_count=1, **options_by_name
    )
    return calibrate(find_recordings(folder), options)


def test_folders_of_pictures_are_recordings_too(shared_lens_rig, traced_rig):
    assert shared_lens_rig.solution.left_out == {}
    rotation_error, position_error = measure_pose_errors(
        shared_lens_rig.world.cameras, traced_rig.cameras[:CAMERA_COUNT]
    )
    assert (rotation_error < 1, position_error < 0.03) == (True, True)


def test_shared_lenses_are_estimated_together_and_each_camera_can_have_its_own(
    picture_folder, shared_lens_rig
):
    separate_lens_rig = _calibrate(picture_folder, LensOptions(is_shared=False))
    assert len({camera.lens.fx for camera in shared_lens_rig.world.cameras}) == 1
    assert (
        len({camera.lens.fx for camera in separate_lens_rig.world.cameras})
        == len(separate_lens_rig.world.cameras)
        > 2
    )


def test_known_lenses_are_used_unchanged(picture_folder, shared_lens_rig, tmp_path):
    with written_folder(tmp_path / "capture") as folder:
        write_capture(shared_lens_rig, folder)
    recordings = find_recordings(picture_folder)
    lenses = read_lenses(tmp_path / "capture", recordings.names, recordings.pictures.sizes)
    changed_lenses = {
        name: replace(lens, fx=1.01 * lens.fx, fy=1.01 * lens.fy) for name, lens in lenses.items()
    }

    calibration = _calibrate(picture_folder, LensOptions(known_lenses=changed_lenses))
    assert calibration.solution.left_out == {}
    for camera in calibration.world.cameras:
        assert camera.lens.fx == pytest.approx(changed_lenses[camera.name].fx)


def test_lenses_of_other_cameras_or_sizes_are_rejected(picture_folder, shared_lens_rig, tmp_path):
    with written_folder(tmp_path / "capture") as folder:
        write_capture(shared_lens_rig, folder)
    with pytest.raises(CalibrationError, match="no intrinsics for camera elsewhere"):
        read_lenses(tmp_path / "capture", ["elsewhere"], [(320, 240)])
    with pytest.raises(CalibrationError, match="the camera's recording is 64x48"):
        read_lenses(tmp_path / "capture", find_recordings(picture_folder).names[:1], [(64, 48)])


def test_nothing_is_matched_where_a_mask_is_black(picture_folder, tmp_path):
    recordings = find_recordings(picture_folder)
    mask = np.zeros((240, 320), np.uint8)
    mask[:, :160] = 255
    (tmp_path / "masks").mkdir()
    assert cv2.imwrite(str(tmp_path / "masks" / f"{recordings.names[0]}.png"), mask)
    masks = read_masks(tmp_path / "masks", recordings)
    assert masks[recordings.names[0]].sum() == 240 * 160

    features = Features(tmp_path, [masks.get(name) for name in recordings.names])
    features.add_moment(
        0, [recordings.pictures.read(i, 0) for i in range(CAMERA_COUNT)], lambda *_: None
    )
    masked_x, unmasked_x = (features.read_keypoints(camera)[0][:, 0] for camera in (0, 1))
    assert masked_x.max() < 161 < unmasked_x.max()


def test_the_noise_of_a_jpeg_mask_is_black(picture_folder, tmp_path):
    recordings = find_recordings(picture_folder)
    name = recordings.names[0]
    mask = np.zeros((240, 320), np.uint8)
    mask[:, :155] = 255
    assert cv2.imwrite(str(tmp_path / f"{name}.jpg"), mask, [cv2.IMWRITE_JPEG_QUALITY, 60])

    assert np.array_equal(read_masks(tmp_path, recordings)[name], mask > 0)


@pytest.mark.parametrize(
    ("name", "size", "error", "message"),
    [
        ("cam00", (240, 320), CalibrationError, "entirely black"),
        ("cam00", (24, 32), MaskSizeError, "is 32x24, but the pictures .* are 320x240"),
        ("elsewhere", (240, 320), MaskNameError, "masks named elsewhere, which match no camera"),
    ],
)
def test_masks_of_another_size_are_rejected(picture_folder, tmp_path, name, size, error, message):
    assert cv2.imwrite(str(tmp_path / f"{name}.png"), np.zeros(size, np.uint8))
    with pytest.raises(error, match=message):
        read_masks(tmp_path, find_recordings(picture_folder))


def test_a_folder_without_masks_is_rejected(picture_folder, tmp_path):
    with pytest.raises(CalibrationError, match="has no masks"):
        read_masks(tmp_path, find_recordings(picture_folder))
