"""Values and gradients of the kernels agree with those of torch operations."""

import pytest
import torch

from quarc_ref.encoder.frames import differentiable
from quarc_ref.encoder.frames.differentiable import (
    mean_log_norm,
    multiply_quaternions,
    round_masked,
    sum_levels,
    sum_log_magnitudes,
)
from quarc_ref.encoder.training.straight_through import without_rounding


def _random(*shape, seed=0):
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed))


def _assert_equal_to_torch(operation, inputs, monkeypatch, atol=1e-6):
    """Compare an operation and its gradients with and without kernels."""
    results = []
    for has_kernels in (True, False):
        monkeypatch.setattr(differentiable, "has_kernels", lambda _, answer=has_kernels: answer)
        leaves = [tensor.clone().requires_grad_() for tensor in inputs]
        value = operation(*leaves)
        (value * torch.linspace(-1, 2, value.numel()).reshape(value.shape)).sum().backward()
        results.append([value.detach(), *(leaf.grad for leaf in leaves)])
    for with_kernels, without_kernels in zip(*results, strict=True):
        assert with_kernels.abs().max() > 0
        assert torch.allclose(with_kernels, without_kernels, rtol=1e-5, atol=atol)


def test_products_of_quaternions(monkeypatch):
    inputs = [_random(50, 4), _random(50, 4, seed=1)]
    _assert_equal_to_torch(multiply_quaternions, inputs, monkeypatch, atol=1e-5)


def test_i_times_j_is_k():
    i, j, k = torch.eye(4)[1:]
    assert torch.equal(multiply_quaternions(i[None], j[None])[0], k)


def test_rounding_within_limits(monkeypatch):
    limits = torch.tensor([1.0, 2.0, 5.0])
    mask = torch.arange(3 * 40).reshape(40, 3) % 4 > 0
    mask[0] = False
    values = 3 * _random(40, 3)
    values[0] = torch.tensor(
        [1.0, -2.0, 2.5]
    )  # two values at the limits, and a value halfway between integers

    _assert_equal_to_torch(lambda leaf: round_masked(leaf, limits, mask), [values], monkeypatch)


def test_sum_of_log_magnitudes(monkeypatch):
    values = 3 * _random(40, 13)
    values[3], values[4] = 1e5, 0.0  # a product of 13 numbers that is no float32; no derivative
    mask = torch.arange(40 * 13).reshape(40, 13) % 3 > 0

    _assert_equal_to_torch(lambda leaf: sum_log_magnitudes(leaf, mask), [values], monkeypatch)


def test_without_rounding_values_are_only_clamped():
    values, limits, mask = _random(9, 2), torch.ones(2), torch.ones(9, 2, dtype=torch.bool)
    with without_rounding():
        assert torch.equal(round_masked(values, limits, mask), values.clamp(-1, 1))


def test_mean_of_log_norms(monkeypatch):
    _assert_equal_to_torch(mean_log_norm, [_random(30, 13)], monkeypatch)


def test_a_row_of_zeros_has_a_finite_gradient():
    leaf = torch.zeros(2, 3, requires_grad=True)
    mean_log_norm(leaf).backward()
    assert torch.equal(leaf.grad, torch.zeros(2, 3))


@pytest.mark.parametrize("levels", [1, 3])
def test_sums_over_levels(levels, monkeypatch):
    anchors = torch.randint(0, 7, (levels, 60), generator=torch.Generator().manual_seed(2))
    anchors[anchors == 3] = 4  # no Gaussian is bound to anchor 3
    flat = anchors.reshape(-1)
    followers = torch.argsort(flat, stable=True) % 60
    starts = torch.nn.functional.pad(torch.bincount(flat, minlength=7).cumsum(0), (1, 0))

    def operation(residuals):
        return sum_levels(residuals, anchors, followers, starts)

    _assert_equal_to_torch(operation, [_random(7, 6)], monkeypatch, atol=1e-5)
