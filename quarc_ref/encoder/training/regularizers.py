"""Regularization and rate terms of the loss of frame 0.

The opacity and scale penalty of 3DGS-MCMC suppresses haze: large faint Gaussians that fit the
training views but are wrong in novel views. The rate term estimates the bits of a Gaussian's
codes from the logarithm of their magnitude or mean absolute deviation.
"""

import torch
from torch import Tensor

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.records import StreamHeader

_MIN_SQUARED_NORM = 1e-24


def opacity_scale_penalty(attributes: Attributes, settings: CanonicalSettings) -> Tensor | float:
    """Return the sum of the mean opacity and the mean scale, each multiplied by its weight."""
    if not (settings.opacity_reg or settings.scale_reg):
        return 0.0
    opacities, scales = torch.sigmoid(attributes.opacities), torch.exp(attributes.log_scales)
    return settings.opacity_reg * opacities.mean() + settings.scale_reg * scales.mean()


def code_rate_nats(
    attributes: Attributes, header: StreamHeader, *, has_sh_rest: bool = True
) -> Tensor:
    """Estimate the mean rate of a Gaussian's codes in nats, excluding position and opacity.

    Codes of rotation and SH rest are mostly 0, so the rate of each is estimated as
    ln(1 + magnitude). The rate of a scale or SH DC code is estimated as ln(1 + mean absolute
    deviation), because the entropy coder adapts to the distribution of each component.

    Args:
        attributes: The Gaussians.
        header: Header of the stream, which contains the quantization steps.
        has_sh_rest: Whether SH rest counts. Before it is trained, it is 0, and must have no
            gradient, because zeros would accumulate in Adam's state.
    """
    nats = _rotation_nats(attributes.rotations, 1 << header.rotation_bits).mean()
    nats = nats + _deviation_nats(attributes.log_scales, header.log_scale_step)
    nats = nats + _deviation_nats(attributes.sh_dc.flatten(1), header.sh_dc_step)
    if has_sh_rest:
        count = attributes.means.shape[0]
        nats = nats + torch.log1p(attributes.sh_rest.abs() / header.sh_rest_step).sum() / count
    return nats


def _rotation_nats(rotations: Tensor, steps_per_unit: int) -> Tensor:
    """Return the `[N]` sums of ln(1 + magnitude in steps) over the three coded components.

    Calling `normalize` and taking the maximum of the logarithms would take twice as long.
    """
    norms = rotations.square().sum(dim=1, keepdim=True).clamp(min=_MIN_SQUARED_NORM)
    codes = rotations.abs() * torch.rsqrt(norms) * steps_per_unit
    return torch.log1p(codes).sum(dim=1) - torch.log1p(codes.amax(dim=1))


def _deviation_nats(values: Tensor, step: float) -> Tensor:
    """Return the sum of ln(1 + mean absolute deviation in steps) over the columns of `[N, c]`."""
    deviations = (values - values.mean(dim=0)).abs().mean(dim=0)
    return torch.log1p(deviations / step).sum()
