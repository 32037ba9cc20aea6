"""Differentiable motion in floats, used for gradients only: SPEC 7.5 and 7.8, paper Eq. 2.

Its results never become part of the state, because only the decoder applies residuals.
The two differ only by rounding on the lattice and in Q22.
"""

from typing import Any

import torch
from torch import Tensor
from torch.autograd import Function

from quarc_ref.decoder.anchors import Anchors
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.records import StreamHeader


class BindingSums:
    """Sums residuals over the anchors that each Gaussian is bound to.

    Args:
        anchors: Anchors of a frame.
        device: Device of the computation.
    """

    def __init__(self, anchors: Anchors, device: torch.device) -> None:
        sizes = [level.owners.size for level in anchors.levels]
        self.borders = torch.tensor([0, *sizes]).cumsum(0)
        binding = torch.from_numpy(anchors.binding) + self.borders[:-1, None]
        self._anchors = binding.to(device)
        flat = binding.reshape(-1)
        self._followers = (torch.argsort(flat, stable=True) % binding.shape[1]).to(device)
        self._counts = torch.bincount(flat, minlength=sum(sizes)).to(device)

    def sum_levels(self, residuals: Tensor) -> Tensor:
        """Return the `[N, c]` sums of each Gaussian's residuals `[A, c]` over the levels."""
        total: Tensor = _SumLevels.apply(residuals, self._anchors, self._followers, self._counts)
        return total


class _SumLevels(Function):
    """Gathers forward; the backward pass sums in a fixed order, for reproducible results."""

    @staticmethod
    def forward(
        ctx: Any,  # noqa: ANN401
        residuals: Tensor,
        anchors: Tensor,
        followers: Tensor,
        counts: Tensor,
    ) -> Tensor:
        ctx.cache = (followers, counts)
        total = residuals.index_select(0, anchors[0])
        for level in anchors[1:]:
            total += residuals.index_select(0, level)
        return total

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None, None, None]:  # noqa: ANN401
        followers, counts = ctx.cache
        rows = gradient.index_select(0, followers)
        sums = torch.segment_reduce(rows, "sum", lengths=counts, axis=0, unsafe=True)
        return sums, None, None, None


def deform(
    attributes: Attributes, translations: Tensor, rotations: Tensor, header: StreamHeader
) -> Attributes:
    """Move attributes by sums of residuals.

    Args:
        attributes: Attributes of the scene before the motion.
        translations: `[N, 3]` translations, world units.
        rotations: `[N, 3 or 4]` residuals from the identity, with steps of
            1 / rotation_unity.
        header: Header of the stream, which has the levels and components.
    """
    identity = float(header.level_count)
    w = rotations[:, :-3].sum(dim=1, keepdim=True) + identity
    return Attributes(
        attributes.means + translations,
        _product(attributes.rotations, torch.cat([w, rotations[:, -3:]], dim=1)),
        attributes.log_scales,
        attributes.opacities,
        attributes.sh_dc,
        attributes.sh_rest,
    )


def rotate(rotations: Tensor, residuals: Tensor) -> Tensor:
    """Rotate `[N, 4]` by residuals `[N, 3]` from the identity (SPEC 7.8)."""
    return _product(rotations, torch.nn.functional.pad(residuals, (1, 0), value=1.0))


def _product(left: Tensor, right: Tensor) -> Tensor:
    """Return the `[N, 4]` Hamilton products, wxyz."""
    aw, ax, ay, az = left.unbind(dim=1)
    bw, bx, by, bz = right.unbind(dim=1)
    return torch.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        dim=1,
    )
