import numpy as np
import pytest

from quarc_ref.datasets.calibration import Lens
from quarc_ref.datasets.opencv_lens import make_opencv_lens


def make_matrix(skew=0.0):
    return np.array([[90, skew, 30.5], [0, 100, 19.5], [0, 0, 1]])


def test_the_centers_of_pixels_move_by_half_a_pixel():
    coefficients = (0.1, 0.0, 0.0)

    assert make_opencv_lens((64, 48), make_matrix(), (0, 0)) == Lens(64, 48, 90, 100, 31, 20)
    assert make_opencv_lens((64, 48), make_matrix(), coefficients).coefficients == coefficients


@pytest.mark.parametrize("sign", [-1, 1])
def test_skew_that_moves_pixels_is_rejected(sign):
    largest_skew = 0.5 * 100 / 28  # The bottom row is 28 pixels below the principal point.
    make_opencv_lens((64, 48), make_matrix(sign * 0.99 * largest_skew), ())

    with pytest.raises(ValueError, match=r"the skew -?1.8 in K moves pixels by up to 0.5"):
        make_opencv_lens((64, 48), make_matrix(sign * 1.008 * largest_skew), ())
