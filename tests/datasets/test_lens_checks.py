from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.datasets.calibration import CalibratedCamera, Lens, Pose
from quarc_ref.datasets.lens_checks import find_odd_principal_points

LENS = Lens(1440, 1080, 1000.0, 1000.0, 720.0, 540.0)


def make_cameras(*lenses):
    pose = Pose(np.eye(3), np.zeros(3))
    return [CalibratedCamera(f"cam{index}", lens, pose) for index, lens in enumerate(lenses)]


@pytest.mark.parametrize(
    "position",
    [{"cx": 0.5}, {"cx": 1440.0}, {"cy": 1080.0}, {"cy": -540.0}, {"cx": 2880.0, "cy": 540.0}],
)
def test_a_principal_point_at_the_border_is_a_finding(position):
    finding = find_odd_principal_points(make_cameras(LENS, replace(LENS, **position)))

    assert (finding.kind, finding.cameras) == ("principal-point", ("cam1",))
    assert "in 1440x1080 pixels" in finding.message


@pytest.mark.parametrize("position", [{}, {"cx": 200.0}, {"cy": 900.0}])
def test_a_principal_point_away_from_the_border_is_no_finding(position):
    assert find_odd_principal_points(make_cameras(replace(LENS, **position))) is None
