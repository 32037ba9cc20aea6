import shutil
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from quarc_ref.datasets.calibration import CalibratedCamera, Lens, Pose
from quarc_ref.datasets.lens_checks import find_odd_principal_points, find_stretched_pixels
from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.datasets.video import VideoReader
from tests.datasets import forgeries, scenes

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


@pytest.mark.parametrize(
    ("fy", "aspect", "is_odd"),
    [
        (1000, 1, 0),
        (1333, 1, 0),
        (1000, 4 / 3, 1),
        (1333, 4 / 3, 0),
        (1310, 4 / 3, 0),
        (750, 4 / 3, 1),
    ],
)
def test_focal_lengths_have_the_ratio_of_the_pixels(fy, aspect, is_odd):
    cameras = make_cameras(LENS, replace(LENS, fy=float(fy)))
    finding = find_stretched_pixels(cameras, [1.0, aspect])

    assert (finding is not None) == is_odd
    if finding:
        assert (finding.kind, finding.cameras) == ("pixel-shape", ("cam1",))
        assert "pixels are 1.33 times as wide as high" in finding.message


def test_a_capture_of_stretched_videos_has_a_finding(n3dv_folder, pictures, tmp_path):
    folder = shutil.copytree(n3dv_folder, tmp_path / "copy")
    assert open_capture(folder).findings == ()
    scenes.write_video(folder / "cam03.mp4", pictures[2], pixel_aspect=Fraction(4, 3))

    (finding,) = open_capture(folder).findings
    assert (finding.kind, finding.cameras) == ("pixel-shape", ("cam03",))


def test_the_pixels_of_a_video_on_its_side_are_turned(pictures, tmp_path):
    path = tmp_path / "cam00.mp4"
    scenes.write_video(path, pictures[0], pixel_aspect=Fraction(4, 3))
    upright_aspect = VideoReader(path).pixel_aspect
    path.write_bytes(forgeries.show_video(path.read_bytes(), "90 clockwise"))

    assert (upright_aspect, VideoReader(path).pixel_aspect) == pytest.approx((4 / 3, 3 / 4))
