import numpy as np
import pytest

from quarc_ref.synth.paints import choose_palette
from quarc_ref.synth.room_kernels import TRACK_HALF_WIDTH, TRACK_RADIUS
from quarc_ref.synth.toys import make_ball, make_crate, make_train, wave

_PALETTE = choose_palette(0)
_PHASES = [0.0, 0.3, 0.77]


def test_a_wave_repeats_after_its_period():
    assert wave(0.5, 2.0, 0.0) == pytest.approx(1)
    assert wave(3.4, 1.7, 0.2) == pytest.approx(wave(0.0, 1.7, 0.2))


@pytest.mark.parametrize("phase", _PHASES)
def test_the_ball_bounces_on_the_floor_and_never_falls_through(phase):
    balls = [make_ball(i / 120, phase, _PALETTE)[0].matrix for i in range(160)]
    lowest = [matrix[1, 3] - np.linalg.norm(matrix[1, :3]) for matrix in balls]

    assert min(lowest) > -1e-9
    assert min(lowest) < 0.02
    assert max(lowest) > 0.33


@pytest.mark.parametrize("phase", _PHASES)
def test_the_ball_deforms_but_keeps_its_volume(phase):
    balls = [make_ball(i / 60, phase, _PALETTE)[0].matrix for i in range(60)]
    heights = [np.linalg.norm(matrix[1, :3]) for matrix in balls]

    np.testing.assert_allclose(
        [np.linalg.det(ball_matrix[:3, :3]) for ball_matrix in balls], 0.2**3
    )
    assert min(heights) < 0.15
    assert max(heights) > 0.21


def test_the_crate_rotates_around_its_table():
    start, later = (make_crate(time, 0.1, _PALETTE)[1].matrix for time in (0.0, 0.2))

    np.testing.assert_allclose(start[:3, 3], later[:3, 3])
    assert np.linalg.norm(start[:3, 0] - later[:3, 0]) > 0.05


@pytest.mark.parametrize("phase", _PHASES)
def test_the_cars_follow_one_another_on_the_track(phase):
    cars = make_train(1.3, phase, _PALETTE)
    wheels = np.array([[solid.matrix[:3, 3] for solid in car[-4:]] for car in cars])
    centers = wheels.mean(axis=1)
    gaps = np.linalg.norm(np.diff(centers, axis=0), axis=1)

    assert (
        np.abs(np.hypot(wheels[..., 0], wheels[..., 2]) - TRACK_RADIUS) < TRACK_HALF_WIDTH
    ).all()
    assert gaps[0] == pytest.approx(gaps[1])
    assert 0.4 < gaps[0] < 0.5
