import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quarc_ref.datasets.capture import Capture
from quarc_ref.encoder.training.views import TrainingViews, measure_extent
from quarc_ref.format.errors import EncodeError
from tests.encoder.toys import make_cameras, make_capture


def test_held_out_cameras_are_unreachable(monkeypatch):
    capture = make_capture()
    accessed_cameras = set()
    image = Capture.image
    monkeypatch.setattr(
        Capture,
        "image",
        lambda self, camera, frame: accessed_cameras.add(camera) or image(self, camera, frame),
    )
    views = TrainingViews(capture, torch.device("cpu"))

    for view in range(len(views.cameras)):
        views.picture(view, 0)

    assert accessed_cameras == set(capture.training) == {1, 2, 3}
    assert [camera.name for camera in views.cameras] == ["cam01", "cam02", "cam03"]


def test_pictures_are_scaled_to_1_for_white():
    capture = make_capture()

    picture = TrainingViews(capture, torch.device("cpu")).picture(0, 1)

    assert np.array_equal(np.round(picture.numpy() * 255), capture.image(1, 1))


def test_halved_views_are_shared_until_frames_are_dropped():
    views = TrainingViews(make_capture(), torch.device("cpu"))
    halved = views.halved()

    assert views.halved() is halved
    views.drop_frames_before(1)
    assert views.halved() is not halved


def test_a_pixel_of_a_halved_picture_is_the_mean_of_four():
    views = TrainingViews(make_capture(), torch.device("cpu"))

    halved = views.halved()

    full_picture, half_picture = views.picture(1, 0), halved.picture(1, 0)
    rows, columns = half_picture.shape[:2]
    assert (rows, columns) == (full_picture.shape[0] // 2, full_picture.shape[1] // 2)
    squares = full_picture[: 2 * rows, : 2 * columns].reshape(rows, 2, columns, 2, 3)
    assert torch.allclose(half_picture, squares.mean(dim=(1, 3)), atol=1e-6)
    assert (halved.cameras[1].width, halved.cameras[1].height) == (columns, rows)


def test_pictures_of_a_pixel_cannot_be_halved():
    camera = make_capture().cameras[0]
    views = TrainingViews(make_capture(), torch.device("cpu"), min(camera.width, camera.height))

    with pytest.raises(EncodeError, match="use larger pictures"):
        views.halved()


@given(position=arrays(np.float64, 3, elements=st.floats(-2, 2)))
def test_a_halved_camera_projects_a_point_to_half_the_coordinates(position):
    views = TrainingViews(make_capture(), torch.device("cpu"))

    for full_camera, half_camera in zip(views.cameras, views.halved().cameras, strict=True):
        assert _project(half_camera, position) == pytest.approx(_project(full_camera, position) / 2)


def _project(camera, position):
    rotation = np.array(camera.rotation).reshape(3, 3)
    x, y, z = rotation @ position + np.array(camera.translation)
    return np.array([camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy])


def test_every_view_is_used_once_before_any_repeats():
    views = TrainingViews(make_capture(), torch.device("cpu"))
    order = views.shuffled_indices(torch.Generator().manual_seed(0), 0)

    for _ in range(5):
        assert sorted(next(order) for _ in range(3)) == [0, 1, 2]


def test_the_extent_is_1_1_times_the_radius_of_the_cameras():
    cameras = tuple(make_cameras(2))
    centers = [
        -np.array(camera.rotation).reshape(3, 3).T @ np.array(camera.translation)
        for camera in cameras
    ]

    assert measure_extent(cameras) == pytest.approx(
        1.1 * np.linalg.norm(centers[0] - centers[1]) / 2
    )
