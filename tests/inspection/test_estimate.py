import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quarc_ref.format.coding.snapshot_planes import Snapshot, compute_differences
from quarc_ref.format.constants import RESIDUAL_ROWS
from quarc_ref.format.records import StreamHeader
from quarc_ref.format.updates import Updates
from quarc_ref.inspection.estimate import (
    estimate_births,
    estimate_bits,
    estimate_gaussians,
    estimate_motion,
    estimate_snapshot,
    estimate_updates,
)
from tests.small_streams import make_births, make_gaussians, make_stream

_SHAPES = st.tuples(st.integers(1, 5), st.integers(0, 40))
CHANNELS = _SHAPES.flatmap(lambda shape: arrays(np.int64, shape, elements=st.integers(-4, 4)))


def entropy(values):
    """Return the zero-order entropy of a sequence in bits."""
    values = list(values)
    frequencies = {value: count / len(values) for value, count in Counter(values).items()}
    return -sum(math.log2(frequencies[value]) for value in values)


def _entropy_bytes(rows):
    return sum(entropy(row.tolist()) for row in rows) / 8


@given(CHANNELS)
def test_bits_are_the_sum_of_the_entropies_of_the_channels(channels):
    expected = sum(entropy(channel) for channel in channels.tolist())

    assert estimate_bits(channels) == pytest.approx(expected, abs=1e-9)


@given(CHANNELS, st.randoms(use_true_random=False))
def test_bits_depend_neither_on_order_nor_on_the_values(channels, random):
    order = list(range(channels.shape[1]))
    random.shuffle(order)

    assert estimate_bits(7 - 3 * channels[:, order]) == pytest.approx(estimate_bits(channels))


def test_known_channels_have_known_estimates():
    alternating = np.array([[0, 1] * 32])
    constant = np.full((3, 64), 9)

    assert estimate_bits(alternating) == 64
    assert estimate_bits(constant) == 0


def test_the_estimate_of_motion_takes_each_channel_over_all_levels():
    _, states = make_stream()
    levels = states[1].symbols

    rows = [np.concatenate([level[channel] for level in levels]) for channel in range(6)]
    assert estimate_motion(levels) == pytest.approx(_entropy_bytes(rows))
    assert estimate_motion(levels) > 0


@pytest.mark.parametrize("degree", [0, 1])
def test_the_estimate_of_a_canonical_frame_counts_every_attribute_of_a_gaussian(degree):
    gaussians = make_gaussians(StreamHeader(sh_degree=degree), 30)

    rows = [*gaussians.positions, *gaussians.rotations, *gaussians.codes]
    assert len(rows) == (14 if degree == 0 else 23)
    assert estimate_gaussians(gaussians) == pytest.approx(_entropy_bytes(rows))


def test_the_estimate_of_births_counts_their_parents_too():
    _, states = make_stream()
    births = make_births(states[0], 20)

    newborn = births.newborn
    rows = [births.parents, *newborn.positions, *newborn.rotations, *newborn.codes]
    assert estimate_births(births) == pytest.approx(_entropy_bytes(rows))


def test_the_estimate_of_updates_has_a_channel_for_each_choice_and_residual():
    residuals = np.zeros((RESIDUAL_ROWS, 4), dtype=np.int64)
    residuals[:3, [0, 2]] = [[1, -1], [0, 2], [0, 0]]
    residuals[9, [0, 2, 3]] = 1, 2, 3
    updates = Updates(np.array([1, 3, 4, 8]), np.array([False, True, False, False]), residuals)

    rows = [[0, 1, 0, 1, 1, 0, 0, 0, 1, 0], [0, 1, 0, 0]]  # of 10 Gaussians, of 4 updates
    rows += [[1, 1, 0], [1, -1], [0, 2], [0, 0]]  # of 3 updates, and of 2 translations
    rows += [[1, 1, 1], [1, 2, 3]]  # opacities
    assert estimate_updates(updates, 10) == pytest.approx(sum(map(entropy, rows)) / 8)


def test_the_estimate_of_a_snapshot_has_differences_and_new_gaussians():
    header = StreamHeader()
    canonical, gaussians = make_gaussians(header, 8, seed=1), make_gaussians(header, 6)
    snapshot = Snapshot(gaussians, np.array([0, -1, 2, 3, -1, 5]))

    rows = [[1, 0, 1, 1, 0, 1, 0, 0], *compute_differences(snapshot, canonical).tolist()]
    attributes = (*gaussians.positions, *gaussians.rotations, *gaussians.codes)
    rows += [row[[1, 4]].tolist() for row in attributes]
    assert estimate_snapshot(snapshot, canonical) == pytest.approx(sum(map(entropy, rows)) / 8)
