import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from quarc_ref.calibration.alignment import align_signals, correlate_signals, subtract_running_mean

RANDOM = np.random.default_rng(5)
EVENT = subtract_running_mean(np.cumsum(RANDOM.standard_normal((400, 1)), axis=0), 9)


def make_shifted(offsets, length=200, noise=0.3):
    noise_level = noise * EVENT.std()
    return [
        EVENT[50 + offset : 50 + offset + length]
        + noise_level * RANDOM.standard_normal((length, 1))
        for offset in offsets
    ]


def find_shifts(signals, max_shift=40):
    return align_signals(
        len(signals),
        lambda a, b: correlate_signals(signals[a], signals[b], max_shift),
        peak_width=2,
    )


def test_planted_shifts_are_found_and_their_median_is_0():
    offsets = [0, 7, -15, 0, 15, 0, -3]

    shifts = find_shifts(make_shifted(offsets))

    assert [shift.samples for shift in shifts] == pytest.approx([-o for o in offsets], abs=0.3)
    assert min(shift.confidence for shift in shifts) > 3


def test_shifts_are_finer_than_a_sample():
    noise = np.random.default_rng(0).standard_normal((4000, 1))
    smooth_noise = gaussian_filter1d(noise, 25, axis=0)
    offsets = np.array([0, 3, -24, 147])  # tenths of a sample

    shifts = find_shifts([smooth_noise[500 + o : 2500 + o : 10] for o in offsets])

    assert np.ptp([shift.samples for shift in shifts] + offsets / 10) < 0.2


def test_an_unrelated_signal_is_not_clear():
    signals = [*make_shifted([0, 4, 9, -6]), RANDOM.standard_normal((200, 1))]

    shifts = find_shifts(signals)

    differences = [shift.samples - shifts[0].samples for shift in shifts[:4]]
    assert differences == pytest.approx([0, -4, -9, 6], abs=0.4)
    assert shifts[4].confidence < 2


def test_constant_signals_are_not_clear():
    shifts = find_shifts([np.zeros((50, 1))] * 3)

    assert [(shift.samples, shift.confidence) for shift in shifts] == [(0, 0)] * 3


def test_pairs_with_nothing_in_common_are_ignored():
    signals = make_shifted([0, 5, -8])

    shifts = align_signals(
        3,
        lambda a, b: None if (a, b) == (0, 2) else correlate_signals(signals[a], signals[b], 20),
        2,
    )

    assert [shift.samples for shift in shifts] == pytest.approx([0, -5, 8], abs=0.4)
