"""Motion surrogate: differentiable motion in floats (SPEC 7.5 and 7.8, paper Eq. 2).

The surrogate is used only to compute gradients; the state of a frame comes from the decoder.
Surrogate and decoder differ only in rounding: the decoder rounds positions to the lattice and
rotations to multiples of 2^-22.
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
        device: Device of the residuals.

    Attributes:
        level_offsets: Index of the first anchor of each level, then the total number of anchors.
    """

    def __init__(self, anchors: Anchors, device: torch.device) -> None:
        anchor_counts = [level.owners.size for level in anchors.levels]
        self.level_offsets = torch.tensor([0, *anchor_counts]).cumsum(0)
        binding = torch.from_numpy(anchors.binding) + self.level_offsets[:-1, None]
        self._anchors = binding.to(device)
        flat_binding = binding.reshape(-1)
        self._followers = (torch.argsort(flat_binding, stable=True) % binding.shape[1]).to(device)
        follower_counts = torch.bincount(flat_binding, minlength=sum(anchor_counts))
        self._starts = torch.nn.functional.pad(follower_counts.cumsum(0), (1, 0)).to(device)

    def sum_levels(self, residuals: Tensor) -> Tensor:
        """Return the `[N, c]` sums of residuals `[A, c]` over each Gaussian's anchors."""
        return sum_levels(residuals, self._anchors, self._followers, self._starts)


def deform(
    attributes: Attributes, translations: Tensor, rotations: Tensor, header: StreamHeader
) -> Attributes:
    """Move Gaussians by sums of residuals; return their new attributes.

    Args:
        attributes: Attributes of the scene before the motion.
        translations: `[N, 3]` sums of translation residuals, world units.
        rotations: `[N, 3]` (xyz) or `[N, 4]` (wxyz) sums of rotation residuals; each residual is
            the difference of a quaternion from the identity.
        header: Header of the stream, which contains the number of anchor levels.
    """
    identity_w = float(header.level_count)
    w = rotations[:, :-3].sum(dim=1, keepdim=True) + identity_w
    return Attributes(
        attributes.means + translations,
        multiply_quaternions(attributes.rotations, torch.cat([w, rotations[:, -3:]], dim=1)),
        attributes.log_scales,
        attributes.opacities,
        attributes.sh_dc,
        attributes.sh_rest,
    )


def rotate(rotations: Tensor, residuals: Tensor) -> Tensor:
    """Rotate quaternions `[N, 4]` by the rotation residuals `[N, 3]` of updates (SPEC 7.8)."""
    return multiply_quaternions(rotations, torch.nn.functional.pad(residuals, (1, 0), value=1.0))
