from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.reconstruct import append_births, begin_frame, move
from quarc_ref.encoder.training.quantize import (
    drop_unrepresentable,
    find_representable_births,
    quantize_births,
    quantize_gaussians,
    quantize_residuals,
)
from quarc_ref.encoder.training.straight_through import position_step
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.format.constants import AXIS_BITS_LIMIT, CODE_LIMIT, POSITION_LIMIT
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import StreamHeader
from tests import strategies
from tests.small_streams import make_gaussians, make_symbols


def _make_attributes(header, count=20, seed=0):
    scene = begin_canonical(header, 0, make_gaussians(header, count, seed)).scene
    return from_splats(dequantize(scene), torch.device("cpu"))


@given(st.data())
def test_a_decoded_scene_quantizes_to_itself(data):
    header = replace(data.draw(strategies.headers()), rotation_bits=data.draw(st.integers(4, 12)))
    gaussians = make_gaussians(header, 12)

    requantized = quantize_gaussians(_make_attributes(header, 12), header)

    assert requantized.positions.tolist() == gaussians.positions.tolist()
    assert requantized.codes.tolist() == gaussians.codes.tolist()
    scenes = [begin_canonical(header, 0, item).scene for item in (gaussians, requantized)]
    rotations = [scene.rotations.astype(np.int64) for scene in scenes]
    overlap = np.abs((rotations[0] * rotations[1]).sum(axis=0)) / 2.0**44
    # The norm of a Q22 quaternion has an error of up to 1e-7.
    assert (1 - overlap).max() < 2.0 ** (1 - 2 * header.rotation_bits) + 1e-6


def test_quantized_attributes_lose_at_most_half_a_step():
    header = StreamHeader()
    generator = torch.Generator().manual_seed(0)
    attributes = _make_attributes(header, 200)
    noisy_attributes = attributes.quantized(header)
    moved_state = (
        noisy_attributes.means
        + torch.rand(noisy_attributes.means.shape, generator=generator) * 0.01
    )
    noisy_attributes = replace(noisy_attributes, means=moved_state)

    splats = dequantize(
        begin_canonical(header, 0, quantize_gaussians(noisy_attributes, header)).scene
    )

    error = np.abs(splats.positions - moved_state.numpy()).max()
    assert error <= position_step(header) / 2 * (1 + 1e-5)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_numbers_that_are_not_finite_cannot_be_written(value):
    header = StreamHeader()
    attributes = _make_attributes(header)
    attributes.opacities[3] = value

    with pytest.raises(EncodeError, match="finite"):
        quantize_gaussians(attributes, header)


def test_codes_beyond_their_range_cannot_be_written():
    header = StreamHeader()
    attributes = _make_attributes(header)
    attributes.log_scales[0, 0] = 1e6

    with pytest.raises(EncodeError, match="use a larger quantization step"):
        quantize_gaussians(attributes, header)


def test_outliers_off_the_lattice_are_dropped():
    header = StreamHeader()
    attributes = _make_attributes(header)
    attributes.means[5, 1] = 1e7

    representable = drop_unrepresentable(attributes, header)

    assert representable.means.shape[0] == 19
    quantize_gaussians(representable, header)


@pytest.mark.parametrize("distance_in_steps", [0, 1_500_000, -1_500_000])
def test_a_scene_far_from_the_origin_is_kept(distance_in_steps):
    header = StreamHeader()
    attributes = _make_attributes(header)
    attributes.means[:] += distance_in_steps * position_step(header)
    attributes.means[4, 1] += 500_000 * position_step(header)
    attributes.means[5, 1] += 1_100_000 * position_step(header)  # outside 2^20 steps

    representable = drop_unrepresentable(attributes, header)

    assert representable.means.shape[0] == 19
    gaussians = quantize_gaussians(representable, header)
    assert np.ptp(gaussians.positions, axis=1).max() < 1 << AXIS_BITS_LIMIT
    assert begin_canonical(header, 0, gaussians).scene.count == 19


def test_an_outlier_is_kept_if_all_gaussians_fit_into_the_box():
    header = StreamHeader()
    attributes = _make_attributes(header)
    attributes.means[5, 1] += 900_000 * position_step(header)  # far from the median

    assert drop_unrepresentable(attributes, header).means.shape[0] == 20


def test_a_scene_without_any_valid_gaussian_is_an_encode_error():
    header = StreamHeader()
    attributes = _make_attributes(header)
    attributes.means[:] = 1e30

    with pytest.raises(EncodeError, match="positions of all trained Gaussians exceed the range"):
        drop_unrepresentable(attributes, header)


def test_a_number_beyond_all_integers_is_an_encode_error():
    header = StreamHeader()
    attributes = _make_attributes(header)
    attributes.log_scales[3, 1] = -1e30

    with pytest.raises(EncodeError, match="an attribute exceeds"):
        quantize_gaussians(attributes, header)


@pytest.mark.parametrize("steps", [CODE_LIMIT, CODE_LIMIT + 1, POSITION_LIMIT])
def test_births_can_be_represented_up_to_a_distance_from_their_parents(steps):
    header = StreamHeader(position_step=8)
    state = begin_frame(begin_canonical(header, 0, make_gaussians(header, 20)), 0)
    parents = torch.tensor([3, 5])
    attributes = _make_attributes(header).rows(parents)
    offset = torch.tensor([[0.0, 0, 0], [0, -steps * position_step(header), 0]])
    new_attributes = replace(attributes, means=attributes.means + offset)

    mask = find_representable_births(new_attributes, parents, state.scene)

    assert mask.tolist() == [True, steps == CODE_LIMIT]
    births = quantize_births(new_attributes.rows(mask), parents[mask].numpy(), state.scene)
    assert append_births(state, births).scene.count == 20 + mask.sum()


def test_births_are_decoded_where_they_were_trained():
    header = StreamHeader()
    frame_start = begin_frame(begin_canonical(header, 0, make_gaussians(header, 30)), 0)
    moved_state = move(frame_start, make_symbols(frame_start))
    new_attributes = _make_attributes(header, 6, seed=9)
    parents = np.array([4, 2, 9, 2, 0, 29])

    births = quantize_births(new_attributes, parents, moved_state.scene)
    splats = dequantize(append_births(moved_state, births).scene)

    order = np.argsort(parents, kind="stable")
    assert births.parents.tolist() == sorted(parents.tolist())
    # Offsets from a parent are rounded, so positions differ by up to half a step.
    assert np.abs(splats.positions[30:] - new_attributes.means.numpy()[order]).max() <= (
        position_step(header) / 2 * (1 + 1e-5)
    )
    assert np.array_equal(splats.opacities[30:], new_attributes.opacities.numpy()[order])


def test_a_newborn_too_far_from_its_parent_cannot_be_written():
    header = StreamHeader()
    frame_start = begin_frame(begin_canonical(header, 0, make_gaussians(header, 30)), 0)
    moved_state = move(frame_start, make_symbols(frame_start))
    new_attributes = _make_attributes(header, 1)
    new_attributes.means[:] = 100.0

    with pytest.raises(EncodeError, match="position of a new Gaussian"):
        quantize_births(new_attributes, np.array([0]), moved_state.scene)


def test_residuals_of_diverged_training_cannot_be_written():
    residuals = torch.tensor([[0.5, torch.nan, 0.0]])

    with pytest.raises(EncodeError, match="training diverged: a motion residual is not finite"):
        quantize_residuals(residuals, 0.25)
