"""What Gaussians cost in the loss of a canonical frame, beside the pictures.

Haze covers much and shows little: it is wrong from other views. Codes take bits,
about as many as the logarithm of their magnitude or of their spread.
"""

import torch
from torch import Tensor

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.records import StreamHeader

_LEAST_SQUARE = 1e-24


def opacity_scale_penalty(attributes: Attributes, settings: CanonicalSettings) -> Tensor | float:
    """Return the price of opacity and of size."""
    if not (settings.opacity_reg or settings.scale_reg):
        return 0.0
    opacities, scales = torch.sigmoid(attributes.opacities), torch.exp(attributes.log_scales)
    return settings.opacity_reg * opacities.mean() + settings.scale_reg * scales.mean()


def code_rate_penalty(
    attributes: Attributes, settings: CanonicalSettings, header: StreamHeader
) -> Tensor | float:
    """Return the price of codes, by about how many nats a Gaussian takes.

    Of rotation and SH rest, for which 0 is usual, every code has its own price.
    Scales and colors cost by how far they spread, row by row: a coder pays the
    logarithm of the spread.
    """
    if not settings.code_rd_lambda:
        return 0.0
    count = attributes.means.shape[0]
    turns = _rotation_nats(attributes.rotations, 1 << header.rotation_bits).mean()
    rest = torch.log1p(attributes.sh_rest.abs() / header.sh_rest_step).sum() / count
    spread = _spread_nats(attributes.log_scales, header.log_scale_step)
    spread = spread + _spread_nats(attributes.sh_dc.flatten(1), header.sh_dc_step)
    return settings.code_rd_lambda * (turns + rest + spread)


def _rotation_nats(rotations: Tensor, unity: int) -> Tensor:
    """Return `[N]` the sum of ln(1 + code) over the components but the largest, which has none.

    Written out: `normalize`, and the largest of the logarithms, take twice as long.
    """
    norms = rotations.square().sum(dim=1, keepdim=True).clamp(min=_LEAST_SQUARE)
    codes = rotations.abs() * torch.rsqrt(norms) * unity
    return torch.log1p(codes).sum(dim=1) - torch.log1p(codes.amax(dim=1))


def _spread_nats(values: Tensor, step: float) -> Tensor:
    """Return the sum of ln(1 + spread in steps) over the columns of `[N, c]`."""
    spread = (values - values.mean(dim=0)).abs().mean(dim=0)
    return torch.log1p(spread / step).sum()
