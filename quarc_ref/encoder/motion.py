"""Stage 1 of a frame: the residuals of the anchors (paper section 4).

Every forward pass draws what quantized residuals would make of the scene; a
price on the residuals keeps still what need not move.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.state import State
from quarc_ref.encoder.config import MotionSettings
from quarc_ref.encoder.density import ScreenStatistics
from quarc_ref.encoder.losses import photometric_loss
from quarc_ref.encoder.quantize import quantize_residuals
from quarc_ref.encoder.straight_through import round_to_step, translation_step
from quarc_ref.encoder.studio import Studio
from quarc_ref.encoder.surrogate import Following, deform
from quarc_ref.encoder.trainable import ADAM_EPSILON, fall_along_cosine, from_splats
from quarc_ref.encoder.warm_start import start_symbols
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import SYMBOL_LIMIT
from quarc_ref.format.records import StreamHeader


@dataclass(frozen=True, slots=True, eq=False)
class FittedMotion:
    """What stage 1 found.

    Attributes:
        symbols: `[c, a]` of each level, level 1 first.
        residuals: `[A, c]` what these stand for, in steps, levels one after the
            other; other than they only `without_rounding`.
        statistics: Screen gradients over the iterations, for the births.
    """

    symbols: list[Int64]
    residuals: Tensor
    statistics: ScreenStatistics


def fit_motion(
    studio: Studio, before: State, begun: State, settings: MotionSettings
) -> FittedMotion:
    """Fit the residuals of a frame to its pictures.

    Args:
        studio: Views, renderer and draws.
        before: State of the frame before.
        begun: The same after `begin_frame`.
        settings: Schedule and price.
    """
    scene, frame = begun.scene, begun.scene.frame
    attributes = from_splats(dequantize(scene), studio.device)
    following = Following(begun.known_anchors, studio.device)
    symbols = start_symbols(before, begun, settings).to(studio.device)
    residuals = _Residuals(symbols, following.borders, scene.header)
    statistics = ScreenStatistics(scene.count, studio.device)
    views = studio.views.shuffled(studio.generator(frame, "motion"))
    adam = torch.optim.Adam(residuals.groups(settings), eps=ADAM_EPSILON, fused=True)
    for step in range(settings.iterations):
        residuals.set_rates(adam, settings, step)
        sums = following.sum_levels(residuals.quantized())
        moved = deform(attributes, *_kinds(sums), scene.header)
        view = next(views)
        rendering = studio.render(moved.activated(), view)
        loss = photometric_loss(rendering.image, studio.truth(view, frame), settings.dssim)
        loss = loss + residuals.price(settings)
        gradient = residuals.step(adam, loss, rendering.means2d)
        statistics.add(gradient, rendering, studio.camera(view))
        studio.progress.advance("motion", step + 1, settings.iterations)
    return FittedMotion(residuals.symbols(), residuals.in_steps(), statistics)


class _Residuals:
    """The residuals of all levels, and their quantizer.

    Args:
        symbols: `[A, c]` where they start, in steps; levels one after the other.
        borders: Where each level begins and ends.
        header: The steps.
    """

    def __init__(self, symbols: Tensor, borders: Tensor, header: StreamHeader) -> None:
        self._steps = (translation_step(header), 1 / header.rotation_unity)
        self._sizes = borders.diff().tolist()
        first, last = borders[:-1].tolist(), borders[1:].tolist()
        self._kinds = [
            [
                (kind[i:j] * step).contiguous().requires_grad_()
                for i, j in zip(first, last, strict=True)
            ]
            for kind, step in zip(_kinds(symbols), self._steps, strict=True)
        ]

    def groups(self, settings: MotionSettings) -> list[dict[str, object]]:
        """Return Adam's groups: of each kind, one to a level."""
        return [{"params": [leaf], "lr": settings.rate} for kind in self._kinds for leaf in kind]

    def set_rates(self, adam: torch.optim.Adam, settings: MotionSettings, step: int) -> None:
        """Set the learning rates of a step: by level, and falling along a cosine."""
        left = fall_along_cosine(step, settings.iterations, settings.rate_end)
        translation = settings.step_rate * self._steps[0] or settings.rate
        rates = [
            rate * left * settings.level_rate**level
            for rate in (translation, settings.rate)
            for level in range(len(self._sizes))
        ]
        for group, rate in zip(adam.param_groups, rates, strict=True):
            group["lr"] = rate

    def quantized(self) -> Tensor:
        """Return `[A, c]` the residuals that the symbols stand for, straight through."""
        parts = []
        for kind, step in zip(self._kinds, self._steps, strict=True):
            limit = SYMBOL_LIMIT * step
            parts.append(round_to_step(torch.cat(kind).clamp(-limit, limit), step))
        return torch.cat(parts, dim=1)

    def price(self, settings: MotionSettings) -> Tensor:
        """Return what the residuals cost, before rounding."""
        kinds = [torch.cat(kind) for kind in self._kinds]
        if settings.price == "l1":
            return settings.price_weight * torch.cat(kinds, dim=1).abs().mean()
        steps = [kind / step for kind, step in zip(kinds, self._steps, strict=True)]
        norms = torch.cat(steps, dim=1).square().sum(dim=1).add(_NORM_FLOOR).sqrt()
        return settings.price_weight * torch.log1p(norms).mean()

    def step(self, adam: torch.optim.Adam, loss: Tensor, extra: Tensor) -> Tensor:
        """Take a step down a loss, and return the gradient by one more tensor of its graph."""
        leaves = [leaf for kind in self._kinds for leaf in kind]
        *gradients, by_extra = torch.autograd.grad(loss, [*leaves, extra])
        for leaf, gradient in zip(leaves, gradients, strict=True):
            leaf.grad = gradient
        adam.step()
        return by_extra

    def in_steps(self) -> Tensor:
        """Return `[A, c]` the residuals that the symbols stand for, in steps."""
        with torch.no_grad():
            kinds = zip(_kinds(self.quantized()), self._steps, strict=True)
            return torch.cat([kind / step for kind, step in kinds], dim=1)

    def symbols(self) -> list[Int64]:
        """Return `[c, a]` of each level."""
        with torch.no_grad():
            residuals = self.quantized()
        kinds = zip(_kinds(residuals), self._steps, strict=True)
        rows = [quantize_residuals(kind, step) for kind, step in kinds]
        borders = np.cumsum(self._sizes)[:-1]
        return np.split(np.concatenate(rows), borders, axis=1)


def _kinds(residuals: Tensor) -> tuple[Tensor, Tensor]:
    """Return the columns of translation and of rotation."""
    return residuals[:, :_TRANSLATION], residuals[:, _TRANSLATION:]


_TRANSLATION = 3
_NORM_FLOOR = 1e-12
