"""Differentiable motion in floats, used for gradients only: SPEC 7.5 and 7.8, paper Eq. 2.

Its results never become part of the state, because only the decoder applies residuals.
The two differ only by rounding on the lattice and in Q22.
"""

import torch
from torch import Tensor

from quarc_ref.decoder.anchors import Anchors
from quarc_ref.encoder.frames.differentiable import multiply_quaternions, sum_levels
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
        counts = torch.bincount(flat, minlength=sum(sizes))
        self._starts = torch.nn.functional.pad(counts.cumsum(0), (1, 0)).to(device)

    def sum_levels(self, residuals: Tensor) -> Tensor:
        """Return the `[N, c]` sums of each Gaussian's residuals `[A, c]` over the levels."""
        return sum_levels(residuals, self._anchors, self._followers, self._starts)


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
        multiply_quaternions(attributes.rotations, torch.cat([w, rotations[:, -3:]], dim=1)),
        attributes.log_scales,
        attributes.opacities,
        attributes.sh_dc,
        attributes.sh_rest,
    )


def rotate(rotations: Tensor, residuals: Tensor) -> Tensor:
    """Rotate `[N, 4]` by residuals `[N, 3]` from the identity (SPEC 7.8)."""
    return multiply_quaternions(rotations, torch.nn.functional.pad(residuals, (1, 0), value=1.0))
