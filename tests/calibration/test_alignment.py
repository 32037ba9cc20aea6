import numpy as np
import pytest

from quarc_ref.calibration.alignment import align, correlate_signals, flatten

RANDOM = np.random.default_rng(5)
EVENT = flatten(np.cumsum(RANDOM.standard_normal((400, 1)), axis=0), 9)


def shifted(offsets, length=200, noise=0.3):
    spread = noise * EVENT.std()
    return [
        EVENT[50 + o : 50 + o + length] + spread * RANDOM.standard_normal((length, 1))
        for o in offsets
    ]


def find(signals, most=40):
    return align(
        len(signals), lambda a, b: correlate_signals(signals[a], signals[b], most), peak_width=2
    )


def test_planted_shifts_are_found_and_their_median_is_0():
    offsets = [0, 7, -15, 0, 15, 0, -3]

    found = find(shifted(offsets))

    assert [shift.samples for shift in found] == pytest.approx([-o for o in offsets], abs=0.3)
    assert min(shift.confidence for shift in found) > 3


def test_an_unrelated_signal_is_not_clear():
    signals = [*shifted([0, 4, 9, -6]), RANDOM.standard_normal((200, 1))]

    found = find(signals)

    differences = [shift.samples - found[0].samples for shift in found[:4]]
    assert differences == pytest.approx([0, -4, -9, 6], abs=0.4)
    assert found[4].confidence < 2


def test_constant_signals_are_not_clear():
    found = find([np.zeros((50, 1))] * 3)

    assert [(shift.samples, shift.confidence) for shift in found] == [(0, 0)] * 3


def test_pairs_with_nothing_in_common_are_ignored():
    signals = shifted([0, 5, -8])

    found = align(
        3,
        lambda a, b: None if (a, b) == (0, 2) else correlate_signals(signals[a], signals[b], 20),
        2,
    )

    assert [shift.samples for shift in found] == pytest.approx([0, -5, 8], abs=0.4)
