"""Updates of individual Gaussians, trained together with the motion (SPEC 7.8).

At first, the residuals of all Gaussians are trained. Partway through training, the updates
that lower the loss enough are selected and trained further; the others are set to zero.
If an update reduces the opacity of a Gaussian to almost 0, the Gaussian is deleted.
"""

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor

from quarc_ref.encoder.frames.differentiable import round_masked
from quarc_ref.encoder.frames.rate_control import RateDistortion
from quarc_ref.encoder.frames.surrogate import rotate
from quarc_ref.encoder.settings.frames import UpdateSettings
from quarc_ref.encoder.training.straight_through import translation_step
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import CODE_LIMIT, RESIDUAL_ROWS, ROTATION_UNITY_LIMIT
from quarc_ref.format.records import StreamHeader
from quarc_ref.format.updates import ROTATION, UPDATE_FIELDS, Updates
from quarc_ref.rendering.rasterizer import Rendering


def add_residuals(attributes: Attributes, residuals: Tensor, header: StreamHeader) -> Attributes:
    """Return attributes after adding the residuals of updates (SPEC 7.8).

    Args:
        attributes: Attributes after the motion.
        residuals: `[N, RESIDUAL_ROWS]` residuals in quantization steps.
        header: Header of the stream, which contains the quantization steps.
    """
    row_counts = [rows.stop - rows.start for rows in UPDATE_FIELDS.values()]
    translations, rotations, scales, opacity, color = torch.split(residuals, row_counts, dim=1)
    return Attributes(
        attributes.means + translations * translation_step(header),
        rotate(attributes.rotations, rotations / header.rotation_unity),
        attributes.log_scales + scales * header.log_scale_step,
        attributes.opacities + opacity[:, 0] * header.opacity_step,
        attributes.sh_dc + color[:, None] * header.sh_dc_step,
        attributes.sh_rest,
    )


class TrainedUpdates:
    """The trained update residuals of all Gaussians of a frame, and their quantizer.

    Args:
        gaussian_count: Number of Gaussians in the scene.
        header: Header of the stream, which contains the quantization steps.
        settings: Learning rate, rate-distortion weight and thresholds.
        device: Device of the residuals.
        rd: Factors by which the rate-distortion weights are multiplied.
    """

    def __init__(
        self,
        gaussian_count: int,
        header: StreamHeader,
        settings: UpdateSettings,
        device: torch.device,
        rd: RateDistortion = RateDistortion(),  # noqa: B008, immutable
    ) -> None:
        self._header, self._settings, self._rd = header, settings, rd
        self._limits = torch.full((RESIDUAL_ROWS,), float(CODE_LIMIT), device=device)
        self._limits[ROTATION] = ROTATION_UNITY_LIMIT
        self._is_selected = torch.ones(gaussian_count, dtype=torch.bool, device=device)
        self._selected_rows = torch.arange(gaussian_count, device=device)
        self.leaf = torch.zeros((gaussian_count, RESIDUAL_ROWS), device=device, requires_grad=True)

    def learning_rate(self, decay: float) -> float:
        """Return the learning rate in quantization steps, multiplied by a decay factor."""
        return self._settings.lr * decay

    def apply_to(self, attributes: Attributes) -> Attributes:
        """Return attributes after adding the quantized updates, with straight-through gradients."""
        return add_residuals(attributes, self._quantized(), self._header)

    def penalty(self) -> Tensor:
        """Return the weighted rate estimate of the unrounded updates.

        The rate is the mean over Gaussians of the sum of ln(1 + magnitude) over their residuals.
        Residuals that reduce the loss too little become 0, even beside large residuals of the same
        Gaussian. In a norm of all its residuals, they would cost almost nothing.
        """
        rate = self.leaf[self._selected_rows].abs().log1p().sum() / self.leaf.shape[0]
        return self._rd.scale_relative(self._settings.rd_lambda) * rate

    def select(
        self,
        attributes: Attributes,
        render: Callable[[Attributes, int], tuple[Rendering, Tensor]],
        view_count: int,
    ) -> None:
        """Select the updates that reduce the loss by more than `min_gain`, and disable the others.

        The gradient of the loss falls about linearly from its value at zero residuals to about 0 at
        the trained residuals, so the gain of an update is estimated as half of the product of its
        residuals and the gradient at zero residuals.

        Args:
            attributes: Attributes after the motion.
            render: Function that renders Gaussians with given attributes in a view, and returns
                the rendering and its loss.
            view_count: Number of views.
        """
        zero_residuals = torch.zeros_like(self.leaf, requires_grad=True)
        mean_gradient = torch.zeros_like(self.leaf)
        for view in range(view_count):
            _, loss = render(add_residuals(attributes, zero_residuals, self._header), view)
            mean_gradient += torch.autograd.grad(loss, zero_residuals)[0] / view_count
        with torch.no_grad():
            gains = -0.5 * (mean_gradient * self._quantized()).sum(dim=1)
            min_gain = self._rd.scale_relative(self._settings.min_gain) / gains.numel()
            self._is_selected = gains > min_gain
            self._selected_rows = torch.nonzero(self._is_selected)[:, 0]  # waits for a GPU

    def quantized_updates(self, attributes: Attributes) -> Updates:
        """Return the quantized updates of a frame.

        Args:
            attributes: Attributes after the motion, to which the updates are added.
        """
        with torch.no_grad():
            residuals = self._quantized()
            updated = self.apply_to(attributes)
            should_delete = residuals[:, UPDATE_FIELDS["opacity"]][:, 0] < 0
            should_delete &= torch.sigmoid(updated.opacities) < self._settings.death_opacity
            if bool(should_delete.all()):
                should_delete[updated.opacities.argmax()] = False
        residual_rows: Int64 = residuals.T.cpu().numpy().astype(np.int64)
        indices = np.flatnonzero(np.any(residual_rows, axis=0))
        dies = should_delete.cpu().numpy()[indices]
        return Updates(indices, dies, residual_rows[:, indices] * ~dies)

    def _quantized(self) -> Tensor:
        """Return the `[N, RESIDUAL_ROWS]` rounded residuals, which are 0 for unselected updates."""
        return round_masked(self.leaf, self._limits, self._is_selected)
