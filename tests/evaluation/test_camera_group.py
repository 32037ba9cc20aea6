import numpy as np
import pytest

from quarc_ref.decoder import dequantize
from quarc_ref.evaluation.camera_group import CameraGroup
from quarc_ref.evaluation.camera_meter import CameraMeter
from quarc_ref.evaluation.color_correction import GAIN_CORRECTION
from quarc_ref.evaluation.regions import find_background
from quarc_ref.streams import decode


@pytest.fixture(scope="module")
def scenes(stream):
    return [(dequantize(scene), scene.frame) for scene in decode(stream)]


def _measure_frames(group, scenes):
    return [group.measure(*scene) for scene in scenes]


def test_each_camera_is_measured_against_its_own_background(capture, scenes):
    group = CameraGroup(capture, capture.cameras, (1, 3))
    frame_views = _measure_frames(group, scenes)

    for position, index in enumerate((1, 3)):
        pictures = [capture.image(index, frame) for frame in range(4)]
        meter = CameraMeter(find_background(pictures))
        metrics = [meter.measure(views[position]) for views in frame_views]
        assert group.quality.per_camera[capture.cameras[index].name] == metrics
        assert np.array_equal(frame_views[2][position].truth_levels, pictures[2])


def test_training_cameras_can_be_measured_too_with_another_correction(capture, scenes):
    group = CameraGroup(capture, capture.cameras, capture.training, GAIN_CORRECTION)
    _measure_frames(group, scenes)

    assert set(group.quality.per_camera) == {"cam00", "cam03"}
    assert group.quality.mean()["gain_psnr"] > group.quality.mean()["psnr"]
    assert len(group.quality.psnr) == 4
