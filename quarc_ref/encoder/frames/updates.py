"""Updates of individual Gaussians, trained together with the motion (SPEC 7.8).

At first, the residuals of all Gaussians are trained. Partway through training, the residuals
that justify their bits are chosen (`residual_choice`) and trained further; the others stay 0. The
trained residuals are chosen again at the end. If an update reduces the opacity of a Gaussian to
almost 0, the Gaussian is deleted.
"""

from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import Tensor

from quarc_ref.encoder.frames.differentiable import round_masked, sum_log_magnitudes
from quarc_ref.encoder.frames.rate_control import RateDistortion
from quarc_ref.encoder.frames.residual_choice import choose_residuals
from quarc_ref.encoder.frames.surrogate import rotate
from quarc_ref.encoder.settings.frames import UpdateSettings
from quarc_ref.encoder.training.straight_through import translation_step
from quarc_ref.encoder.training.trainable import Attributes, to_columns, to_rows
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import CODE_LIMIT, RESIDUAL_ROWS, ROTATION_UNITY_LIMIT
from quarc_ref.format.records import StreamHeader
from quarc_ref.format.updates import ROTATION, UPDATE_FIELDS, Updates
from quarc_ref.rendering.rasterizer import Rendering

# Renders Gaussians with given attributes in a view; returns the rendering and its loss.
RenderView = Callable[[Attributes, int], tuple[Rendering, Tensor]]


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
        self.leaf = torch.zeros((gaussian_count, RESIDUAL_ROWS), device=device, requires_grad=True)
        self._is_trained = torch.ones_like(self.leaf, dtype=torch.bool)
        self._gradient_at_zero: Tensor | None = None

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
        rate = sum_log_magnitudes(self.leaf, self._is_trained) / len(self.leaf)
        return self._rd.scale_relative(self._settings.rd_lambda) * rate

    def choose_residuals(
        self, attributes: Attributes, render: RenderView, views: Sequence[int]
    ) -> None:
        """Reduce the residuals that do not justify their bits; train only those that are not 0.

        The residuals of Gaussians that would be deleted remain. The gradient at zero residuals is
        measured only by the first call, because the motion hardly changes after it.

        Args:
            attributes: Attributes after the motion.
            render: Function that renders a view.
            views: The views to render.
        """
        gaussian_count = len(self.leaf)
        rd_lambda = self._rd.scale_relative(self._settings.quantize_rd_lambda) / gaussian_count
        if not rd_lambda:
            return
        with torch.no_grad():
            residuals = self._quantized()
            is_updated = residuals.any(dim=1) & ~self._find_deaths(attributes, residuals)
            (rows,) = torch.nonzero(is_updated, as_tuple=True)
        if self._gradient_at_zero is None:
            zeros = torch.zeros_like(residuals)
            self._gradient_at_zero = self._measure_gradient(zeros, attributes, render, views)
        gradient = self._measure_gradient(residuals, attributes, render, views)
        columns = choose_residuals(
            to_columns(residuals[rows]).astype(np.int64),
            to_columns(gradient[rows]),
            to_columns(self._gradient_at_zero[rows]),
            gaussian_count,
            rd_lambda,
        )
        with torch.no_grad():
            chosen = residuals.clone()
            chosen[rows] = to_rows(columns.astype(np.float64), residuals[rows])
            self.leaf.copy_(torch.where(chosen == residuals, self.leaf, chosen))
            self._is_trained = chosen != 0

    def quantized_updates(self, attributes: Attributes) -> Updates:
        """Return the quantized updates of a frame.

        Args:
            attributes: Attributes after the motion, to which the updates are added.
        """
        with torch.no_grad():
            residuals = self._quantized()
            should_delete = self._find_deaths(attributes, residuals)
        residual_rows: Int64 = residuals.T.cpu().numpy().astype(np.int64)
        indices = np.flatnonzero(np.any(residual_rows, axis=0))
        dies = should_delete.cpu().numpy()[indices]
        return Updates(indices, dies, residual_rows[:, indices] * ~dies)

    def _find_deaths(self, attributes: Attributes, residuals: Tensor) -> Tensor:
        """Return a mask of the Gaussians that residuals fade to almost 0; one is always kept."""
        opacities = add_residuals(attributes, residuals, self._header).opacities
        should_delete = residuals[:, UPDATE_FIELDS["opacity"]][:, 0] < 0
        should_delete &= torch.sigmoid(opacities) < self._settings.death_opacity
        if bool(should_delete.all()):
            should_delete[opacities.argmax()] = False
        return should_delete

    def _measure_gradient(
        self, residuals: Tensor, attributes: Attributes, render: RenderView, views: Sequence[int]
    ) -> Tensor:
        """Return the gradient of the mean loss of views by residuals."""
        leaf = residuals.detach().requires_grad_()
        mean_gradient = torch.zeros_like(residuals)
        for view in views:
            _, loss = render(add_residuals(attributes, leaf, self._header), view)
            mean_gradient += torch.autograd.grad(loss, leaf)[0] / len(views)
        return mean_gradient

    def _quantized(self) -> Tensor:
        """Return the `[N, RESIDUAL_ROWS]` rounded residuals; those that are not trained are 0."""
        return round_masked(self.leaf, self._limits, self._is_trained)
