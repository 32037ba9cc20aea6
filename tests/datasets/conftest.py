"""Captures for several tests, which must not write into them."""

import pytest

from tests.datasets import scenes


@pytest.fixture(scope="session")
def shots():
    return scenes.make_shots()


@pytest.fixture(scope="session")
def points():
    return scenes.plane_points()


@pytest.fixture(scope="session")
def n3dv_folder(tmp_path_factory, shots, points):
    return scenes.write_n3dv(tmp_path_factory.mktemp("n3dv") / "plane", shots, points=points)


@pytest.fixture(scope="session")
def pictures(n3dv_folder, shots):
    """`[camera][frame]` decoded pictures of the videos in `n3dv_folder`."""
    return [scenes.read_video(n3dv_folder / f"{shot.name}.mp4") for shot in shots]
