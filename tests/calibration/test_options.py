"""Options of `calibrate`: masks, known lenses, separate lenses, pictures."""

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
from tests.calibration.rigs import compare

CAMERAS = 5


@pytest.fixture(scope="module")
def few(traced, tmp_path_factory):
    """Pictures of neighboring cameras, in a folder for each."""
    folder = tmp_path_factory.mktemp("few")
    recordings = find_recordings(traced.folder)
    for index, name in enumerate(recordings.names[:CAMERAS]):
        (folder / name).mkdir()
        picture = recordings.pictures.read(index, 0)
        assert cv2.imwrite(str(folder / name / "0000.png"), picture[..., ::-1])
    return folder


@pytest.fixture(scope="module")
def shared(few):
    return _calibrate(few)


def _calibrate(folder, lenses=None, **others):
    options = CalibrateOptions(lenses or LensOptions(), sync=SyncMethod.NONE, moments=1, **others)
    return calibrate(find_recordings(folder), options)


def test_folders_of_pictures_are_recordings_too(shared, traced):
    assert shared.solution.left_out == {}
    angle, place = compare(shared.world.cameras, traced.true[:CAMERAS])
    assert (angle < 1, place < 0.03) == (True, True)


def test_shared_lenses_are_estimated_together_and_each_camera_can_have_its_own(few, shared):
    each = _calibrate(few, LensOptions(shared=False))
    assert len({camera.lens.fx for camera in shared.world.cameras}) == 1
    assert len({camera.lens.fx for camera in each.world.cameras}) == len(each.world.cameras) > 2


def test_known_lenses_are_used_unchanged(few, shared, tmp_path):
    with written_folder(tmp_path / "capture") as folder:
        write_capture(shared, folder)
    recordings = find_recordings(few)
    known = read_lenses(tmp_path / "capture", recordings.names, recordings.pictures.sizes)
    other = {
        name: replace(lens, fx=1.01 * lens.fx, fy=1.01 * lens.fy) for name, lens in known.items()
    }

    found = _calibrate(few, LensOptions(known=other))
    assert found.solution.left_out == {}
    for camera in found.world.cameras:
        assert camera.lens.fx == pytest.approx(other[camera.name].fx)


def test_lenses_of_other_cameras_or_sizes_are_rejected(few, shared, tmp_path):
    with written_folder(tmp_path / "capture") as folder:
        write_capture(shared, folder)
    with pytest.raises(CalibrationError, match="no lens for camera elsewhere"):
        read_lenses(tmp_path / "capture", ["elsewhere"], [(320, 240)])
    with pytest.raises(CalibrationError, match="its recording is 64x48"):
        read_lenses(tmp_path / "capture", find_recordings(few).names[:1], [(64, 48)])


def test_nothing_is_matched_where_a_mask_is_black(few, tmp_path):
    recordings = find_recordings(few)
    mask = np.zeros((240, 320), np.uint8)
    mask[:, :160] = 255
    (tmp_path / "masks").mkdir()
    assert cv2.imwrite(str(tmp_path / "masks" / f"{recordings.names[0]}.png"), mask)
    masks = read_masks(tmp_path / "masks", recordings)
    assert masks[recordings.names[0]].sum() == 240 * 160

    features = Features(tmp_path, [masks.get(name) for name in recordings.names])
    features.add_moment(
        0, [recordings.pictures.read(i, 0) for i in range(CAMERAS)], lambda *_: None
    )
    masked, free = (features.read_keypoints(camera)[0][:, 0] for camera in (0, 1))
    assert masked.max() < 161 < free.max()


@pytest.mark.parametrize(
    ("name", "size", "error", "message"),
    [
        ("cam00", (240, 320), CalibrationError, "entirely black"),
        ("cam00", (24, 32), MaskSizeError, "is 32x24, but the pictures .* are 320x240"),
        ("elsewhere", (240, 320), MaskNameError, "masks named elsewhere, which match no camera"),
    ],
)
def test_masks_of_another_size_are_rejected(few, tmp_path, name, size, error, message):
    assert cv2.imwrite(str(tmp_path / f"{name}.png"), np.zeros(size, np.uint8))
    with pytest.raises(error, match=message):
        read_masks(tmp_path, find_recordings(few))


def test_a_folder_without_masks_is_rejected(few, tmp_path):
    with pytest.raises(CalibrationError, match="has no masks"):
        read_masks(tmp_path, find_recordings(few))
