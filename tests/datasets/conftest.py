"""Captures that several tests read, written once; none of them writes into these."""

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
    """`[camera][frame]` what the videos of `n3dv_folder` decode to."""
    return [scenes.read_video(n3dv_folder / f"{shot.name}.mp4") for shot in shots]
