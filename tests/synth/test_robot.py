import numpy as np
import pytest

from quarc_ref.synth.paints import choose_palette
from quarc_ref.synth.robot import make_robot
from quarc_ref.synth.solid_kernels import CAPSULE

_PALETTE = choose_palette(0)
_TIMES = [0.0, 0.17, 0.4, 0.63, 5.1]


def _measure_lengths(solids):
    """Return the lengths of the capsules' axes."""
    return [
        2 * solid.parameter * np.linalg.norm(solid.matrix[:3, 1])
        for solid in solids
        if solid.shape == CAPSULE
    ]


@pytest.mark.parametrize("time", _TIMES)
def test_limbs_keep_their_lengths(time):
    (legs, upper), (first_legs, first_upper) = (make_robot(t, 0.3, _PALETTE) for t in (time, 0.9))

    np.testing.assert_allclose(_measure_lengths(legs), 0.21)
    np.testing.assert_allclose(_measure_lengths(legs), _measure_lengths(first_legs))
    # The neck comes first and bends when the head tilts.
    np.testing.assert_allclose(_measure_lengths(upper)[1:], _measure_lengths(first_upper)[1:])


@pytest.mark.parametrize("time", _TIMES)
def test_one_foot_is_on_the_floor(time):
    legs, _ = make_robot(time, 0.3, _PALETTE)
    feet = [legs[index].matrix for index in (2, 5)]
    lowest = [matrix[1, 3] - np.linalg.norm(matrix[1, :3]) for matrix in feet]

    assert min(lowest) == pytest.approx(0, abs=1e-9)


def test_the_waving_hand_moves_more_than_the_body():
    uppers = [make_robot(i / 30, 0.3, _PALETTE)[1] for i in range(30)]
    travels = [
        np.ptp([upper[index].matrix[:3, 3] for upper in uppers], axis=0).max() for index in (0, 10)
    ]

    assert travels[1] > 1.5 * travels[0]
