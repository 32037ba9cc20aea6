import math

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.decoder.rotation import expand_rotations
from quarc_ref.encoder.training.straight_through import (
    round_rotations,
    round_to_step,
    split_rotations,
    without_rounding,
)

_COMPONENT = st.floats(-1, 1, width=32)


@given(st.floats(-100, 100), st.sampled_from([1 / 64, 0.0017, 0.5]))
def test_rounding_goes_to_the_nearest_multiple_and_passes_the_gradient(value, step):
    leaf = torch.tensor([value], dtype=torch.float64, requires_grad=True)

    rounded = round_to_step(leaf, step)
    rounded.backward()

    assert abs(float(rounded.detach()) - value) <= step / 2 * (1 + 1e-9)
    assert math.isclose(
        float(rounded.detach()) / step, round(float(rounded.detach()) / step), abs_tol=1e-6
    )
    assert leaf.grad.tolist() == [1.0]


@given(st.tuples(_COMPONENT, _COMPONENT, _COMPONENT, _COMPONENT), st.integers(4, 14))
def test_rounded_rotations_are_what_the_decoder_expands(components, bits):
    if max(map(abs, components)) < 1e-3:
        return
    quaternion = torch.tensor([components], dtype=torch.float32)
    unit = torch.nn.functional.normalize(quaternion, dim=1)
    index, smaller_components = split_rotations(unit, bits)
    coded = np.concatenate([index[None].numpy(), smaller_components.T.numpy().astype(np.int64)])

    rounded = round_rotations(quaternion, bits)[0]
    decoded = torch.from_numpy(expand_rotations(coded, bits)[:, 0]) / (1 << 22)

    error = min(float((rounded - decoded).abs().max()), float((rounded + decoded).abs().max()))
    assert error < 1e-6
    assert float((rounded - unit[0]).norm()) < 2.0 ** (1 - bits)


def test_the_gradient_of_rounded_rotations_is_that_of_the_normalization():
    leaf = torch.tensor([[0.9, 0.1, -0.3, 0.2]], requires_grad=True)
    reference_leaf = torch.tensor([[0.9, 0.1, -0.3, 0.2]], requires_grad=True)
    weights = torch.tensor([[1.0, 2.0, 3.0, 4.0]])

    (round_rotations(leaf, 8) * weights).sum().backward()
    (torch.nn.functional.normalize(reference_leaf, dim=1) * weights).sum().backward()

    assert torch.equal(leaf.grad, reference_leaf.grad)


def test_nothing_is_rounded_if_no_stream_will_be_written():
    values, quaternion = torch.tensor([0.3, 7.7]), torch.tensor([[2.0, 1.0, 0.3, 0.0]])
    unit = quaternion / quaternion.norm()

    with without_rounding():
        assert torch.equal(round_to_step(values, 0.5), values)
        assert torch.allclose(round_rotations(quaternion, 1), unit)
    assert torch.equal(round_to_step(values, 0.5), torch.tensor([0.5, 7.5]))
    assert not torch.allclose(round_rotations(quaternion, 1), unit)
