import pytest

from quarc_ref.datasets.calibration import Lens
from quarc_ref.datasets.colmap_cameras import make_colmap_camera, make_lens
from tests.datasets import lenses

_PINHOLE = Lens(96, 64, 70.0, 72.0, 50.0, 30.0)


@pytest.mark.parametrize(
    ("lens", "model"),
    [
        (_PINHOLE, "PINHOLE"),
        (lenses.BARREL, "OPENCV"),
        (lenses.PINCUSHION, "OPENCV"),
        (lenses.RATIONAL, "FULL_OPENCV"),
        (lenses.FISHEYE, "OPENCV_FISHEYE"),
        (lenses.EQUIDISTANT, "OPENCV_FISHEYE"),
    ],
)
def test_a_lens_becomes_a_camera_of_colmap_and_back(lens, model):
    camera = make_colmap_camera(lens, 7)
    read_lens = make_lens("cam00", camera)

    assert (camera.camera_id, camera.model.name) == (7, model)
    for name in ("width", "height", "fx", "fy", "cx", "cy", "fisheye"):
        assert getattr(read_lens, name) == getattr(lens, name)
    padding = (0.0,) * (len(read_lens.coefficients) - len(lens.coefficients))
    assert read_lens.coefficients == lens.coefficients + padding
