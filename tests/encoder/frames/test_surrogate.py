import numpy as np
import pytest
import torch

from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.reconstruct import begin_frame, move
from quarc_ref.encoder.frames.surrogate import BindingSums, deform
from quarc_ref.encoder.training.straight_through import translation_step
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.format.records import StreamHeader
from tests.small_streams import make_gaussians, make_symbols


@pytest.mark.parametrize("components", [3, 4])
def test_the_surrogate_moves_a_scene_as_the_decoder_does(components):
    header = StreamHeader(rotation_components=components, gaussians_per_anchor=2)
    frame_start = begin_frame(begin_canonical(header, 0, make_gaussians(header, 200)), 0)
    symbols = make_symbols(frame_start, seed=1)
    rows = torch.tensor(np.concatenate(symbols, axis=1).T, dtype=torch.float32)
    steps = [translation_step(header)] * 3 + [1 / header.rotation_unity] * components
    binding_sums = BindingSums(frame_start.required_anchors, torch.device("cpu"))
    sums = binding_sums.sum_levels(rows * torch.tensor(steps))

    attributes = from_splats(dequantize(frame_start.scene), torch.device("cpu"))
    moved_attributes = deform(attributes, sums[:, :3], sums[:, 3:], header)

    decoded = dequantize(move(frame_start, symbols).scene)
    unit = torch.nn.functional.normalize(moved_attributes.rotations, dim=1).numpy()
    # The decoder's rounding changes positions hardly, and rotations by a few units of Q22.
    assert np.abs(moved_attributes.means.numpy() - decoded.positions).max() < 1e-6
    assert np.abs(unit - decoded.rotations).max() < 2e-6


def test_the_gradient_of_an_anchor_is_the_sum_over_its_followers():
    header = StreamHeader(gaussians_per_anchor=3)
    frame_start = begin_frame(begin_canonical(header, 0, make_gaussians(header, 50)), 0)
    binding_sums = BindingSums(frame_start.required_anchors, torch.device("cpu"))
    count = int(binding_sums.level_offsets[-1])
    leaf = torch.randn(count, 2, requires_grad=True)
    weights = torch.randn(50, 2)

    (binding_sums.sum_levels(leaf) * weights).sum().backward()

    expected = torch.zeros(count, 2)
    for start, binding in zip(
        binding_sums.level_offsets, frame_start.required_anchors.binding, strict=False
    ):
        expected.index_add_(0, torch.from_numpy(binding) + start, weights)
    assert torch.allclose(leaf.grad, expected, atol=1e-5)
