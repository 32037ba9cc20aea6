"""Adaptive density control as in 3DGS.

Gaussians with large screen-space gradients are cloned if small and split if large. Nearly
transparent Gaussians are pruned.
"""

import math

import numpy as np
import torch
from torch import Tensor

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training import density_kernels
from quarc_ref.encoder.training.trainable import Attributes, Trainer
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.pipeline import KERNEL_LOCK
from quarc_ref.rendering.rasterizer import Rendering, convert_gradient_to_ndc
from quarc_ref.rendering.tensor_arrays import has_kernels, to_array

_SPLIT_COUNT = 2
_SPLIT_SCALE_DIVISOR = 0.8 * _SPLIT_COUNT


class ScreenStatistics:
    """Screen-space gradients and radii of every Gaussian, accumulated over rendered views.

    Args:
        count: Number of Gaussians.
        device: Device that holds the gradients.
    """

    def __init__(self, count: int, device: torch.device) -> None:
        self._gradient_sums = torch.zeros(count, device=device)
        self._view_counts = torch.zeros(count, device=device)
        self._max_radii = torch.zeros(count, device=device)

    def add(self, gradient: Tensor, rendering: Rendering, camera: Camera) -> None:
        """Add the gradients and radii of a rendered view.

        Args:
            gradient: `[N, 2]` gradient of the loss with respect to `rendering.means2d`.
            rendering: Rendering of the view.
            camera: Camera of the view.
        """
        if has_kernels(gradient):
            half_size = (np.float32(camera.width / 2), np.float32(camera.height / 2))
            outputs = (to_array(values) for values in self.state().values())
            with KERNEL_LOCK:
                density_kernels.add_screen_statistics(
                    to_array(gradient), to_array(rendering.radii), half_size, *outputs
                )
            return
        is_visible = rendering.radii > 0
        self._gradient_sums += torch.where(
            is_visible, convert_gradient_to_ndc(gradient, camera).norm(dim=1), 0
        )
        self._view_counts += is_visible
        self._max_radii = torch.maximum(self._max_radii, rendering.radii)

    def add_for_last_gaussians(
        self, gradient: Tensor, rendering: Rendering, camera: Camera
    ) -> None:
        """Add a rendered view in which these Gaussians come after all other Gaussians."""
        count = self._gradient_sums.numel()
        last_rendering = Rendering(
            rendering.image, rendering.alpha, rendering.means2d, rendering.radii[-count:]
        )
        self.add(gradient.reshape(-1, 2)[-count:], last_rendering, camera)

    def mean_gradients(self) -> Tensor:
        """Return the `[N]` mean gradient norms in NDC; 0 for Gaussians that were never visible."""
        return self._gradient_sums / self._view_counts.clamp(min=1)

    def state(self) -> dict[str, Tensor]:
        """Return the accumulated sums, view counts and radii, each `[N]`."""
        return {"sums": self._gradient_sums, "views": self._view_counts, "radii": self._max_radii}

    def restore(self, state: dict[str, Tensor]) -> None:
        """Replace the accumulated values with tensors that `state` returned."""
        self._gradient_sums, self._view_counts, self._max_radii = (
            state[name].to(self._gradient_sums.device) for name in ("sums", "views", "radii")
        )

    def largest_radii(self) -> Tensor:
        """Return the `[N]` largest screen-space radius of each Gaussian, in pixels."""
        return self._max_radii

    def without(self, is_deleted: Tensor) -> "ScreenStatistics":
        """Return the statistics without the Gaussians in the mask `is_deleted` `[N]`."""
        remaining_statistics = ScreenStatistics(0, self._gradient_sums.device)
        remaining_statistics.restore(
            {name: values[~is_deleted] for name, values in self.state().items()}
        )
        return remaining_statistics


def densify(
    trainer: Trainer,
    statistics: ScreenStatistics,
    settings: CanonicalSettings,
    extent: float,
    generator: torch.Generator,
) -> None:
    """Clone, split and prune the Gaussians of a trainer as in 3DGS.

    Args:
        trainer: Trainer; its Gaussians are modified in place.
        statistics: Screen-space gradients since the last densification.
        settings: Thresholds and maximum number of Gaussians.
        extent: Extent of the capture, world units.
        generator: Random generator for the positions of split Gaussians.
    """
    attributes = trainer.attributes.detached()
    gradients = statistics.mean_gradients()
    max_new_count = max(settings.max_gaussians - trainer.count, 0)
    is_selected = _mask_largest(gradients, max_new_count) & (
        gradients >= settings.densify_grad_threshold
    )
    is_large = attributes.log_scales.amax(dim=1).exp() > settings.densify_scale_threshold * extent
    clones = attributes.rows(is_selected & ~is_large)
    split_gaussians = split(attributes.rows(is_selected & is_large), generator)
    keep_mask = ~(is_selected & is_large)
    keep_mask &= torch.sigmoid(attributes.opacities) >= settings.prune_opacity
    trainer.replace_rows(keep_mask, clones.joined(split_gaussians))


def split(attributes: Attributes, generator: torch.Generator) -> Attributes:
    """Return two smaller Gaussians for each Gaussian, at positions sampled from it."""
    repeated = Attributes(*(torch.cat([tensor] * _SPLIT_COUNT) for tensor in attributes.tensors()))
    offsets = sample_offsets(repeated, 1.0, generator)
    return Attributes(
        repeated.means + offsets,
        repeated.rotations,
        repeated.log_scales - math.log(_SPLIT_SCALE_DIVISOR),
        repeated.opacities,
        repeated.sh_dc,
        repeated.sh_rest,
    )


def sample_offsets(
    attributes: Attributes, scale_factor: float, generator: torch.Generator
) -> Tensor:
    """Sample an offset from each Gaussian, scaled by `scale_factor`; returns detached `[N, 3]`."""
    noise = torch.randn(attributes.means.shape, generator=generator).to(attributes.means.device)
    return _rotate_vectors(attributes.rotations, noise * attributes.log_scales.exp() * scale_factor)


def _rotate_vectors(rotations: Tensor, vectors: Tensor) -> Tensor:
    """Rotate vectors `[N, 3]` by quaternions wxyz `[N, 4]`, which are normalized first."""
    if has_kernels(vectors):
        rotated = np.empty(vectors.shape, dtype=np.float32)
        with KERNEL_LOCK:
            density_kernels.rotate_vectors(to_array(rotations), to_array(vectors), rotated)
        return torch.from_numpy(rotated)
    unit_quaternions = torch.nn.functional.normalize(rotations, dim=1)
    w, xyz = unit_quaternions[:, :1], unit_quaternions[:, 1:]
    double_cross = 2 * torch.linalg.cross(xyz, vectors)
    result: Tensor = vectors + w * double_cross + torch.linalg.cross(xyz, double_cross)
    return result


def _mask_largest(values: Tensor, count: int) -> Tensor:
    """Return a mask of the `count` largest values."""
    mask = torch.zeros_like(values, dtype=torch.bool)
    mask[torch.topk(values, min(count, values.numel())).indices] = True
    return mask
