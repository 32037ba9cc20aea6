"""Registered cameras with few points, some of them with a wrong pose."""

from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.calibration import calibrate as module
from quarc_ref.calibration.calibrate import CalibrateOptions, calibrate
from quarc_ref.calibration.offsets import SyncMethod
from quarc_ref.calibration.recordings import find_recordings
from quarc_ref.datasets.calibration import make_pose

FEW = 28  # points


def _turn(camera, degrees=20):
    """A camera rotated to its side at its position."""
    angle = np.radians(degrees)
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    center = -camera.pose.rotation.T @ camera.pose.translation
    return replace(camera, pose=make_pose(camera.pose.rotation.T @ turn, center))


@pytest.mark.parametrize("degrees", [0, 20])
def test_a_camera_with_few_points_is_left_out_if_its_picture_contradicts_its_pose(
    rig, traced, monkeypatch, degrees
):
    solution, name = rig.solution, "cam07"
    planted = replace(
        solution,
        cameras=tuple(
            _turn(camera, degrees) if camera.name == name else camera for camera in solution.cameras
        ),
        fits=solution.fits | {name: replace(solution.fits[name], support=FEW)},
    )
    monkeypatch.setattr(module, "_solve", lambda *_: (planted, 1))
    found = calibrate(find_recordings(traced.folder), CalibrateOptions(sync=SyncMethod.NONE))

    if degrees:
        assert list(found.solution.left_out) == [name]
        assert f"{FEW} of its points" in found.solution.left_out[name]
        assert len(found.world.cameras) == 12
    else:
        assert found.solution.left_out == {}
        assert found.doubtful == (name,)
