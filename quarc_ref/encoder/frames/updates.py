"""Updates of individual Gaussians, trained together with the motion (SPEC 7.8).

Initially every Gaussian may change individually. Partway through training, the updates
that lower the loss enough are selected and trained further; the others are reset to zero.
A Gaussian that an update has faded out is deleted.
"""

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor

from quarc_ref.encoder.frames.differentiable import mean_log_norm, round_kept
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


def add_residuals(moved: Attributes, residuals: Tensor, header: StreamHeader) -> Attributes:
    """Add residuals to attributes (SPEC 7.8).

    Args:
        moved: Attributes after the motion.
        residuals: `[N, RESIDUAL_ROWS]` in steps.
        header: Header of the stream: the quantization steps.
    """
    sizes = [rows.stop - rows.start for rows in UPDATE_FIELDS.values()]
    translations, rotations, scales, opacity, color = torch.split(residuals, sizes, dim=1)
    return Attributes(
        moved.means + translations * translation_step(header),
        rotate(moved.rotations, rotations / header.rotation_unity),
        moved.log_scales + scales * header.log_scale_step,
        moved.opacities + opacity[:, 0] * header.opacity_step,
        moved.sh_dc + color[:, None] * header.sh_dc_step,
        moved.sh_rest,
    )


class TrainedUpdates:
    """Residuals of every Gaussian of a frame in training, and their quantizer.

    Args:
        count: Number of Gaussians of the scene.
        header: Header of the stream: the quantization steps.
        settings: Learning rate, rate-distortion weight and selection.
        device: Device of the residuals.
        rd: Scale of the rate-distortion weights.
    """

    def __init__(
        self,
        count: int,
        header: StreamHeader,
        settings: UpdateSettings,
        device: torch.device,
        rd: RateDistortion = RateDistortion(),  # noqa: B008, immutable
    ) -> None:
        self._header, self._settings, self._rd = header, settings, rd
        self._limits = torch.full((RESIDUAL_ROWS,), float(CODE_LIMIT), device=device)
        self._limits[ROTATION] = ROTATION_UNITY_LIMIT
        self._kept = torch.ones(count, dtype=torch.bool, device=device)
        self.leaf = torch.zeros((count, RESIDUAL_ROWS), device=device, requires_grad=True)

    def learning_rate(self, decay: float) -> float:
        """Return the learning rate in steps, multiplied by a decay factor."""
        return self._settings.lr * decay

    def apply_to(self, moved: Attributes) -> Attributes:
        """Return moved attributes plus quantized updates (straight-through gradients)."""
        return add_residuals(moved, self._quantized(), self._header)

    def penalty(self) -> Tensor:
        """Return the weighted rate of the unrounded updates: mean of ln(1 + norm of residuals)."""
        rate = mean_log_norm(self.leaf * self._kept[:, None])
        return self._rd.relative(self._settings.rd_lambda) * rate

    def select(
        self,
        moved: Attributes,
        render: Callable[[Attributes, int], tuple[Rendering, Tensor]],
        view_count: int,
    ) -> None:
        """Keep the updates that reduce the loss enough, and disable the others.

        The gain of an update is estimated from the gradient at zero residuals: half of its linear
        prediction, because the gradient falls to about 0 at the trained residuals.

        Args:
            moved: Attributes after the motion.
            render: Function that renders attributes in a view and returns rendering and loss.
            view_count: Number of views.
        """
        nothing = torch.zeros_like(self.leaf, requires_grad=True)
        slope = torch.zeros_like(self.leaf)
        for view in range(view_count):
            _, loss = render(add_residuals(moved, nothing, self._header), view)
            slope += torch.autograd.grad(loss, nothing)[0] / view_count
        with torch.no_grad():
            gains = -0.5 * (slope * self._quantized()).sum(dim=1)
            least = self._rd.relative(self._settings.min_gain) / gains.numel()
            self._kept = gains > least

    def updates(self, before: Attributes) -> Updates:
        """Return the quantized updates of a frame.

        Args:
            before: Attributes to which they are added.
        """
        with torch.no_grad():
            residuals = self._quantized()
            after = self.apply_to(before)
            faded = residuals[:, UPDATE_FIELDS["opacity"]][:, 0] < 0
            faded &= torch.sigmoid(after.opacities) < self._settings.death_opacity
            if bool(faded.all()):
                faded[after.opacities.argmax()] = False
        rows: Int64 = residuals.T.cpu().numpy().astype(np.int64)
        chosen = np.flatnonzero(np.any(rows, axis=0))
        dies = faded.cpu().numpy()[chosen]
        return Updates(chosen, dies, rows[:, chosen] * ~dies)

    def _quantized(self) -> Tensor:
        """Return the `[N, RESIDUAL_ROWS]` quantized residuals of the kept updates in steps."""
        return round_kept(self.leaf, self._limits, self._kept)
