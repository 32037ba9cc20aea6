"""Captures that several tests share; tests must not write into the folders."""

import pytest

from quarc_ref.datasets.calibration import CalibratedCamera, Lens, make_pose
from tests.datasets import scenes


@pytest.fixture(scope="session")
def shots():
    return scenes.make_shots()


@pytest.fixture(scope="session")
def points():
    return scenes.make_plane_points()


@pytest.fixture(scope="session")
def n3dv_folder(tmp_path_factory, shots, points):
    return scenes.write_n3dv(tmp_path_factory.mktemp("n3dv") / "plane", shots, points=points)


@pytest.fixture(scope="session")
def pictures(n3dv_folder, shots):
    """Decoded pictures `[camera][frame]` of the videos in `n3dv_folder`."""
    return [scenes.read_video(n3dv_folder / f"{shot.name}.mp4") for shot in shots]


@pytest.fixture(scope="session")
def video(tmp_path_factory):
    """An mp4 file of `scenes.VIDEO_FRAME_COUNT` frames, with its frame table at the start."""
    shot = scenes.make_shots()[0]
    path = tmp_path_factory.mktemp("video") / "cam00.mp4"
    pictures = [scenes.render(shot, frame_time) for frame_time in range(scenes.VIDEO_FRAME_COUNT)]
    scenes.write_video(path, pictures, faststart=True)
    return path


@pytest.fixture(scope="session")
def decoded_frames(video):
    """The frames of `video`."""
    return scenes.read_video(video)


@pytest.fixture(scope="session")
def cameras_and_pictures():
    """Cameras in front of the plane y = 0, and their pictures."""
    shots = scenes.make_shots(count=5, size=(160, 120), focal=150.0)
    cameras = [
        CalibratedCamera(
            shot.name,
            Lens(shot.width, shot.height, shot.fx, shot.fy, shot.cx, shot.cy),
            make_pose(shot.axes, shot.center),
        )
        for shot in shots
    ]
    return cameras, [scenes.render(shot, painting=scenes.paint_grains, samples=4) for shot in shots]
