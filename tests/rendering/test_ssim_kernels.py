import numpy as np
import pytest
import torch
from skimage.metrics import structural_similarity

from quarc_ref.encoder.training import losses
from quarc_ref.encoder.training.losses import _convolved_ssim, mean_ssim, photometric_loss
from quarc_ref.rendering import ssim_kernels


def _make_pair(height, width, dtype, seed=0):
    generator = torch.Generator().manual_seed(seed)
    truth = torch.rand(height, width, 3, generator=generator, dtype=torch.float64)
    noise = 0.2 * torch.randn(height, width, 3, generator=generator, dtype=torch.float64)
    return (truth + noise).clamp(0, 1).to(dtype).requires_grad_(), truth.to(dtype)


@pytest.mark.parametrize(("height", "width"), [(1, 1), (7, 9), (40, 33), (64, 100)])
def test_numba_and_convolutions_give_the_same_value_and_gradient(height, width):
    fast, truth = _make_pair(height, width, torch.float32)
    exact, truth64 = _make_pair(height, width, torch.float64)

    value, expected = mean_ssim(fast, truth), _convolved_ssim(exact, truth64).mean()
    (numba_gradient,) = torch.autograd.grad(value, fast)
    (expected_gradient,) = torch.autograd.grad(expected, exact)

    assert float(value.detach()) == pytest.approx(float(expected.detach()), abs=1e-6)
    assert float((expected_gradient - numba_gradient).norm() / expected_gradient.norm()) < 1e-5


def test_away_from_the_borders_it_equals_ssim_of_scikit_image():
    image, truth = _make_pair(80, 90, torch.float64)
    ssim = _convolved_ssim(image.detach(), truth)[:, 12:-12, 12:-12]

    _, expected = structural_similarity(
        image.detach().numpy(),
        truth.numpy(),
        data_range=1.0,
        channel_axis=2,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        full=True,
    )

    # scikit-image also truncates the window at 3.5 sigma; only the borders differ.
    assert np.abs(ssim.permute(1, 2, 0).numpy() - expected[12:-12, 12:-12]).max() < 1e-5


def test_the_loss_weights_l1_and_dssim():
    image, truth = _make_pair(20, 30, torch.float32)
    l1 = float((image - truth).abs().mean().detach())
    dssim = 1 - float(mean_ssim(image, truth).detach())

    assert float(photometric_loss(image, truth, 0.2).detach()) == pytest.approx(
        0.8 * l1 + 0.2 * dssim, rel=1e-5
    )
    assert float(photometric_loss(truth, truth, 0.2)) == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(
    ("dtype", "cache", "owner", "function"),
    [
        (torch.float32, losses._MOMENT_CACHE, ssim_kernels, "ssim_moments"),
        (torch.float64, losses._TORCH_MOMENT_CACHE, losses, "_blur_moments"),
    ],
)
def test_moments_are_computed_once_and_freed_with_their_picture(
    monkeypatch, dtype, cache, owner, function
):
    image, truth = _make_pair(20, 30, dtype)
    initial_count = len(cache)

    ssim = mean_ssim(image, truth)
    monkeypatch.setattr(owner, function, None)

    assert mean_ssim(image, truth) == ssim
    assert len(cache) == initial_count + 1
    del truth
    assert len(cache) == initial_count
