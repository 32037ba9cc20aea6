"""Updates of single Gaussians, trained together with the motion (SPEC 7.8).

At first every Gaussian may change on its own. When most of the way is gone those
stay that take more off the loss than an update must, and are trained to the end;
all others are as if they had never been. A Gaussian that has been faded out leaves.
"""

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor

from quarc_ref.encoder.frames.surrogate import rotate
from quarc_ref.encoder.settings.frames import UpdateSettings
from quarc_ref.encoder.training.straight_through import round_to_step, translation_step
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import CODE_LIMIT, RESIDUAL_ROWS, ROTATION_UNITY_LIMIT
from quarc_ref.format.records import StreamHeader
from quarc_ref.format.updates import ROTATION, TRANSLATION, UPDATE_FIELDS, Updates
from quarc_ref.rendering.rasterizer import Rendering


def add_residuals(moved: Attributes, residuals: Tensor, header: StreamHeader) -> Attributes:
    """Return attributes after the motion, with residuals added.

    Args:
        moved: Of the scene.
        residuals: `[N, RESIDUAL_ROWS]` in steps.
        header: The steps.
    """
    scales, opacity, color = (
        residuals[:, UPDATE_FIELDS[name]] for name in ("log-scales", "opacity", "SH DC")
    )
    return Attributes(
        moved.means + residuals[:, TRANSLATION] * translation_step(header),
        rotate(moved.rotations, residuals[:, ROTATION] / header.rotation_unity),
        moved.log_scales + scales * header.log_scale_step,
        moved.opacities + opacity[:, 0] * header.opacity_step,
        moved.sh_dc + color[:, None] * header.sh_dc_step,
        moved.sh_rest,
    )


class TrainedUpdates:
    """What is added to every Gaussian of a frame, and its quantizer.

    Args:
        count: Gaussians of the scene.
        header: The steps.
        settings: Rate and price.
        device: Where they are trained.
    """

    def __init__(
        self, count: int, header: StreamHeader, settings: UpdateSettings, device: torch.device
    ) -> None:
        self._header, self._settings = header, settings
        self._limits = torch.full((RESIDUAL_ROWS,), float(CODE_LIMIT), device=device)
        self._limits[ROTATION] = ROTATION_UNITY_LIMIT
        self._kept = torch.ones((count, 1), device=device)
        self.leaf = torch.zeros((count, RESIDUAL_ROWS), device=device, requires_grad=True)

    def rate(self, left: float) -> float:
        """Return the learning rate, in steps, where a share of it is left."""
        return self._settings.lr * left

    def added_to(self, moved: Attributes) -> Attributes:
        """Return attributes after the motion, with the updates, straight through."""
        return add_residuals(moved, self._quantized(), self._header)

    def price(self) -> Tensor:
        """Return what the updates cost, before rounding: ln(1 + norm of a Gaussian's residuals)."""
        norms = (self.leaf * self._kept).square().sum(dim=1).add(_NORM_FLOOR).sqrt()
        return self._settings.rd_lambda * torch.log1p(norms).mean()

    def choose(
        self,
        moved: Attributes,
        lose: Callable[[Attributes, int], tuple[Rendering, Tensor]],
        view_count: int,
    ) -> None:
        """Keep the updates that gain enough; the others are nothing from now on.

        What an update gains is told by the gradient where there is none: of what that
        promises, half is gained by the time that it has come to nothing.

        Args:
            moved: Attributes after the motion.
            lose: Draws attributes in a view, and gives the loss.
            view_count: How many views there are.
        """
        nothing = torch.zeros_like(self.leaf, requires_grad=True)
        slope = torch.zeros_like(self.leaf)
        for view in range(view_count):
            _, loss = lose(add_residuals(moved, nothing, self._header), view)
            slope += torch.autograd.grad(loss, nothing)[0] / view_count
        with torch.no_grad():
            gains = -0.5 * (slope * self._quantized()).sum(dim=1)
            least = self._settings.min_gain / gains.numel()
            self._kept = (gains > least).to(self.leaf.dtype)[:, None]

    def updates(self, before: Attributes) -> Updates:
        """Return the updates of a frame.

        Args:
            before: The attributes that they are added to.
        """
        with torch.no_grad():
            residuals = self._quantized()
            after = self.added_to(before)
            faded = residuals[:, UPDATE_FIELDS["opacity"]][:, 0] < 0
            faded &= torch.sigmoid(after.opacities) < self._settings.death_opacity
            if bool(faded.all()):
                faded[after.opacities.argmax()] = False
        rows: Int64 = residuals.T.cpu().numpy().astype(np.int64)
        chosen = np.flatnonzero(np.any(rows, axis=0))
        dies = faded.cpu().numpy()[chosen]
        return Updates(chosen, dies, rows[:, chosen] * ~dies)

    def _quantized(self) -> Tensor:
        """Return `[N, RESIDUAL_ROWS]` the residuals of those kept, in steps, straight through."""
        return round_to_step(torch.clamp(self.leaf, -self._limits, self._limits), 1.0) * self._kept


_NORM_FLOOR = 1e-12
