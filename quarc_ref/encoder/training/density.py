"""Adaptive density control as in 3DGS.

Gaussians with large screen-space gradients are cloned if small and split if large; nearly
transparent ones are pruned.
"""

import math

import torch
from torch import Tensor

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.trainable import Attributes, Trainer
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.rasterizer import Rendering, to_ndc

_SPLIT_INTO = 2
_SPLIT_SHRINK = 0.8 * _SPLIT_INTO


class ScreenStatistics:
    """Mean screen-space gradient of every Gaussian over the views that see it.

    Args:
        count: Number of Gaussians.
        device: Device that holds the gradients.
    """

    def __init__(self, count: int, device: torch.device) -> None:
        self._sums = torch.zeros(count, device=device)
        self._views = torch.zeros(count, device=device)
        self._radii = torch.zeros(count, device=device)

    def add(self, gradient: Tensor, rendering: Rendering, camera: Camera) -> None:
        """Add a view.

        Args:
            gradient: Gradient of the loss with respect to `rendering.means2d`.
            rendering: Rendering of the view.
            camera: Camera of the view.
        """
        seen = rendering.radii > 0
        self._sums += torch.where(seen, to_ndc(gradient, camera).norm(dim=1), 0)
        self._views += seen
        self._radii = torch.maximum(self._radii, rendering.radii)

    def add_last(self, gradient: Tensor, rendering: Rendering, camera: Camera) -> None:
        """Add a view whose last rows are these Gaussians."""
        count = self._sums.numel()
        part = Rendering(
            rendering.image, rendering.alpha, rendering.means2d, rendering.radii[-count:]
        )
        self.add(gradient.reshape(-1, 2)[-count:], part, camera)

    def mean_gradients(self) -> Tensor:
        """Return the `[N]` mean gradients in NDC; 0 for Gaussians that no view has seen."""
        return self._sums / self._views.clamp(min=1)

    def state(self) -> dict[str, Tensor]:
        """Return the accumulated tensors, each `[N]`."""
        return {"sums": self._sums, "views": self._views, "radii": self._radii}

    def restore(self, state: dict[str, Tensor]) -> None:
        """Restore tensors returned by `state`."""
        self._sums, self._views, self._radii = (
            state[name].to(self._sums.device) for name in ("sums", "views", "radii")
        )

    def largest_radii(self) -> Tensor:
        """Return the `[N]` largest radii in pixels."""
        return self._radii

    def without(self, gone: Tensor) -> "ScreenStatistics":
        """Return the statistics without the Gaussians of a mask `[N]`."""
        left = ScreenStatistics(0, self._sums.device)
        left.restore({name: values[~gone] for name, values in self.state().items()})
        return left


def densify(
    trainer: Trainer,
    statistics: ScreenStatistics,
    settings: CanonicalSettings,
    extent: float,
    generator: torch.Generator,
) -> None:
    """Clone, split and prune the Gaussians of a trainer as in 3DGS.

    Args:
        trainer: Trainer, which is modified in place.
        statistics: Statistics since the last call.
        settings: Thresholds and maximum number of Gaussians.
        extent: Extent of the capture, world units.
        generator: Random generator for the positions of split Gaussians.
    """
    attributes = trainer.attributes.detached()
    gradients = statistics.mean_gradients()
    room = max(settings.max_gaussians - trainer.count, 0)
    chosen = _largest(gradients, room) & (gradients >= settings.densify_grad_threshold)
    large = attributes.log_scales.amax(dim=1) > math.log(settings.densify_scale_threshold * extent)
    cloned = attributes.rows(chosen & ~large)
    parts = split(attributes.rows(chosen & large), generator)
    kept = ~(chosen & large)
    kept &= torch.sigmoid(attributes.opacities) >= settings.prune_opacity
    trainer.replace_rows(kept, cloned.joined(parts))


def split(attributes: Attributes, generator: torch.Generator) -> Attributes:
    """Replace each Gaussian by two smaller ones, sampled from it."""
    twice = Attributes(*(torch.cat([rows] * _SPLIT_INTO) for rows in attributes.tensors()))
    offsets = draw_within(twice, 1.0, generator)
    return Attributes(
        twice.means + offsets,
        twice.rotations,
        twice.log_scales - math.log(_SPLIT_SHRINK),
        twice.opacities,
        twice.sh_dc,
        twice.sh_rest,
    )


def draw_within(attributes: Attributes, spread: float, generator: torch.Generator) -> Tensor:
    """Sample `[N, 3]` offsets from the Gaussians, with scales multiplied by `spread`."""
    noise = torch.randn(attributes.means.shape, generator=generator).to(attributes.means.device)
    local = noise * torch.exp(attributes.log_scales) * spread
    unit = torch.nn.functional.normalize(attributes.rotations, dim=1)
    w, v = unit[:, :1], unit[:, 1:]
    twice = 2 * torch.linalg.cross(v, local)
    offsets: Tensor = local + w * twice + torch.linalg.cross(v, twice)
    return offsets


def _largest(values: Tensor, count: int) -> Tensor:
    """Return a mask of the `count` largest values."""
    mask = torch.zeros_like(values, dtype=torch.bool)
    mask[torch.topk(values, min(count, values.numel())).indices] = True
    return mask
