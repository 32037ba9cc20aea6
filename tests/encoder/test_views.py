import numpy as np
import pytest
import torch

from quarc_ref.datasets.capture import Capture
from quarc_ref.encoder.views import TrainingViews, measure_extent
from tests.encoder.toys import make_cameras, make_capture


def test_held_out_cameras_are_not_reachable(monkeypatch):
    capture = make_capture()
    looked_at = set()
    image = Capture.image
    monkeypatch.setattr(
        Capture,
        "image",
        lambda self, camera, frame: looked_at.add(camera) or image(self, camera, frame),
    )
    views = TrainingViews(capture, torch.device("cpu"))

    for view in range(len(views.cameras)):
        views.picture(view, 0)

    assert looked_at == set(capture.training) == {1, 2, 3}
    assert [camera.name for camera in views.cameras] == ["cam01", "cam02", "cam03"]


def test_pictures_are_shares_of_white():
    capture = make_capture()

    picture = TrainingViews(capture, torch.device("cpu")).picture(0, 1)

    assert np.array_equal(np.round(picture.numpy() * 255), capture.image(1, 1))


def test_every_view_comes_once_before_any_comes_again():
    views = TrainingViews(make_capture(), torch.device("cpu"))
    order = views.shuffled(torch.Generator().manual_seed(0))

    for _ in range(5):
        assert sorted(next(order) for _ in range(3)) == [0, 1, 2]


def test_the_extent_is_the_radius_of_the_cameras_and_a_tenth():
    cameras = tuple(make_cameras(2))
    centers = [
        -np.array(camera.rotation).reshape(3, 3).T @ np.array(camera.translation)
        for camera in cameras
    ]

    assert measure_extent(cameras) == pytest.approx(
        1.1 * np.linalg.norm(centers[0] - centers[1]) / 2
    )
