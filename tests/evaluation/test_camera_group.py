import numpy as np
import pytest

from quarc_ref.decoder import dequantize
from quarc_ref.evaluation.camera_group import CameraGroup
from quarc_ref.evaluation.camera_meter import CameraMeter
from quarc_ref.evaluation.color_correction import GAIN
from quarc_ref.evaluation.regions import find_background
from quarc_ref.streams import decode


@pytest.fixture(scope="module")
def scenes(stream):
    return [(dequantize(scene), scene.frame) for scene in decode(stream)]


def _measure(group, scenes):
    return [group.measure(*scene) for scene in scenes]


def test_each_camera_is_measured_against_its_own_background(capture, scenes):
    group = CameraGroup(capture, capture.cameras, (1, 3))
    seen = _measure(group, scenes)

    for place, index in enumerate((1, 3)):
        pictures = [capture.image(index, frame) for frame in range(4)]
        meter = CameraMeter(find_background(pictures))
        alone = [meter.measure(views[place]) for views in seen]
        assert group.quality.per_camera[capture.cameras[index].name] == alone
        assert np.array_equal(seen[2][place].image, pictures[2])


def test_training_cameras_can_be_measured_too_with_another_correction(capture, scenes):
    group = CameraGroup(capture, capture.cameras, capture.training, GAIN)
    _measure(group, scenes)

    assert set(group.quality.per_camera) == {"cam00", "cam03"}
    assert group.quality.mean()["gain_psnr"] > group.quality.mean()["psnr"]
    assert len(group.quality.psnr) == 4
