"""Trainable Gaussians: raw attributes and their Adam state.

Densification removes and adds Gaussians; the remaining Gaussians keep their Adam state.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.encoder.training.adam import ADAM_STATE_KEYS, Adam, make_initial_state
from quarc_ref.encoder.training.straight_through import (
    position_step,
    round_rotations,
    round_to_step,
)
from quarc_ref.format.constants import SH_C0
from quarc_ref.format.records import StreamHeader
from quarc_ref.rendering.rasterizer import Gaussians, activate_opacities

_MIN_OPACITY = 1e-5


@dataclass(frozen=True, slots=True, eq=False)
class Attributes:
    """Raw attributes as 3DGS stores them, one row per Gaussian.

    Attributes:
        means: `[N, 3]` positions, world units.
        rotations: `[N, 4]` quaternions wxyz, not normalized.
        log_scales: `[N, 3]` natural logarithms of scales in world units.
        opacities: `[N]` opacity logits.
        sh_dc: `[N, 1, 3]` SH coefficients of degree 0.
        sh_rest: `[N, 3, 3]` SH coefficients of degree 1; `[N, 0, 3]` if they are not rendered.
    """

    means: Tensor
    rotations: Tensor
    log_scales: Tensor
    opacities: Tensor
    sh_dc: Tensor
    sh_rest: Tensor

    def rows(self, selection: Tensor) -> "Attributes":
        """Return the Gaussians that a mask `[N]` or an index tensor selects."""
        return Attributes(*(tensor[selection] for tensor in self.tensors()))

    def joined(self, other: "Attributes") -> "Attributes":
        """Return the Gaussians of this object followed by those of `other`."""
        pairs = zip(self.tensors(), other.tensors(), strict=True)
        return Attributes(*(torch.cat(pair) for pair in pairs))

    def tensors(self) -> tuple[Tensor, ...]:
        """Return the six tensors in the order of the fields."""
        return (
            self.means,
            self.rotations,
            self.log_scales,
            self.opacities,
            self.sh_dc,
            self.sh_rest,
        )

    def detached(self) -> "Attributes":
        """Return detached copies of all tensors."""
        return Attributes(*(tensor.detach().clone() for tensor in self.tensors()))

    def quantized(self, header: StreamHeader) -> "Attributes":
        """Return the attributes quantized as in a stream, with straight-through gradients."""
        return Attributes(
            round_to_step(self.means, position_step(header)),
            round_rotations(self.rotations, header.rotation_bits),
            round_to_step(self.log_scales, header.log_scale_step),
            round_to_step(self.opacities, header.opacity_step),
            round_to_step(self.sh_dc, header.sh_dc_step),
            round_to_step(self.sh_rest, header.sh_rest_step),
        )

    def activated(self) -> Gaussians:
        """Return Gaussians with activated scales and opacities, for rendering."""
        return Gaussians(
            self.means,
            self.rotations,
            torch.exp(self.log_scales),
            activate_opacities(self.opacities),
            torch.cat([self.sh_dc, self.sh_rest], dim=1),
        )


ATTRIBUTE_NAMES = tuple(field.name for field in fields(Attributes))


def from_splats(splats: Splats, device: torch.device) -> Attributes:
    """Return the attributes of a decoded scene; `sh_rest` is 0 if the stream has no SH degree 1."""
    sh = torch.zeros((splats.positions.shape[0], 4, 3), device=device)
    sh[:, : splats.sh.shape[1]] = torch.from_numpy(splats.sh).to(device)
    return Attributes(
        torch.from_numpy(splats.positions).to(device),
        torch.from_numpy(splats.rotations).to(device),
        torch.from_numpy(splats.log_scales).to(device),
        torch.from_numpy(splats.opacities).to(device),
        sh[:, :1].contiguous(),
        sh[:, 1:].contiguous(),
    )


class Trainer:
    """Attributes and their Adam optimizer; Gaussians can be removed and added.

    Args:
        attributes: Initial attributes.
        learning_rates: Learning rate of each attribute, in the order of `Attributes`.
    """

    def __init__(self, attributes: Attributes, learning_rates: tuple[float, ...]) -> None:
        self._leaves = [_make_leaf(tensor) for tensor in attributes.tensors()]
        self._learning_rates = learning_rates
        self._adam = Adam()

    @property
    def attributes(self) -> Attributes:
        """The attributes as leaves of the autograd graph."""
        return Attributes(*self._leaves)

    @property
    def count(self) -> int:
        """Number of Gaussians."""
        return int(self._leaves[0].shape[0])

    def set_learning_rates(self, learning_rates: Iterable[float]) -> None:
        """Set the learning rate of each attribute, in the order of `Attributes`."""
        self._learning_rates = tuple(learning_rates)

    def step(self, loss: Tensor, extra_tensor: Tensor) -> Tensor:
        """Take an optimizer step on a loss; return the gradient with respect to `extra_tensor`."""
        *gradients, extra_gradient = torch.autograd.grad(
            loss, [*self._leaves, extra_tensor], allow_unused=True
        )
        self._adam.step(self._leaves, gradients, self._learning_rates)
        return extra_gradient

    def decay_opacity(self, mask: Tensor, fraction: float) -> None:
        """Reduce the opacities of the Gaussians in a mask `[N]` by a fraction from 0 to 1."""
        logits = self._leaves[ATTRIBUTE_NAMES.index("opacities")].detach()
        decayed_opacities = torch.sigmoid(logits) * (1 - fraction)
        logits.copy_(torch.where(mask, torch.logit(decayed_opacities, eps=_MIN_OPACITY), logits))

    def state(self) -> dict[str, Tensor]:
        """Return attributes and Adam state by name, such as `means` and `means.exp_avg`."""
        state = {}
        for name, leaf in zip(ATTRIBUTE_NAMES, self._leaves, strict=True):
            state[name] = leaf.detach()
            adam_state = self._adam.state.get(leaf) or make_initial_state(leaf)
            state |= {f"{name}.{key}": adam_state[key] for key in ADAM_STATE_KEYS}
        return state

    def restore(self, state: dict[str, Tensor]) -> None:
        """Restore attributes and Adam state from tensors returned by `state`."""
        device = self._leaves[0].device
        self._leaves = [_make_leaf(state[name].to(device)) for name in ATTRIBUTE_NAMES]
        self._adam.state.clear()
        for name, leaf in zip(ATTRIBUTE_NAMES, self._leaves, strict=True):
            self._adam.state[leaf] = {
                key: state[f"{name}.{key}"].to(device) for key in ADAM_STATE_KEYS
            }

    def replace_rows(self, keep_mask: Tensor, new_rows: Attributes) -> None:
        """Keep the Gaussians in `keep_mask` `[N]`, and append new ones with zero Adam state."""
        new_leaves = []
        for old_leaf, new_tensor in zip(self._leaves, new_rows.tensors(), strict=True):
            leaf = _make_leaf(torch.cat([old_leaf.detach()[keep_mask], new_tensor]))
            state = self._adam.state.pop(old_leaf, None)
            if state is not None:
                for moment in ("exp_avg", "exp_avg_sq"):
                    state[moment] = torch.cat(
                        [state[moment][keep_mask], torch.zeros_like(new_tensor)]
                    )
                self._adam.state[leaf] = state
            new_leaves.append(leaf)
        self._leaves = new_leaves

    def replace_codes(self, attributes: Attributes, axes: Tensor) -> None:
        """Replace rotations, log-scales and SH DC, whose codes were chosen (see `rdoq`).

        The first moments of these three are set to 0. Their second moments are kept, because Adam's
        next steps would be too large without them.

        Args:
            attributes: New attributes of the same Gaussians.
            axes: `[N, 3]` former index of each axis.
        """
        for name in ("rotations", "log_scales", "sh_dc"):
            leaf = self._leaves[ATTRIBUTE_NAMES.index(name)]
            leaf.detach().copy_(getattr(attributes, name))
            state = self._adam.state.get(leaf)
            if state is None:
                continue
            state["exp_avg"].zero_()
            squares = state["exp_avg_sq"]
            if name == "log_scales":
                squares.copy_(squares.gather(1, axes))
            elif name == "rotations":  # with other axes, the components are mixed
                squares.copy_(squares.mean(dim=1, keepdim=True).expand_as(squares))


def to_sh_dc(colors: Tensor) -> Tensor:
    """Convert colors from 0 to 1 to SH DC coefficients (SPEC 10.2)."""
    return (colors - 0.5) / SH_C0


def to_columns(rows: Tensor) -> NDArray[np.float64]:
    """Return the rows of a tensor `[N, ...]` as the columns `[k, N]` of an array."""
    columns: NDArray[np.float64] = rows.detach().flatten(1).T.double().cpu().numpy()
    return columns


def to_rows(columns: NDArray[np.float64], like: Tensor) -> Tensor:
    """Return columns `[k, N]` as a tensor of the same shape, type and device as another one."""
    return torch.from_numpy(columns.T.copy()).reshape(like.shape).to(like)


def cosine_decay(step: int, iterations: int, end_factor: float) -> float:
    """Return the cosine decay factor of a step: 1 at step 0, `end_factor` at `iterations`."""
    cosine = (1 + math.cos(math.pi * step / iterations)) / 2
    return end_factor + (1 - end_factor) * cosine


def _make_leaf(tensor: Tensor) -> Tensor:
    return tensor.detach().clone().contiguous().requires_grad_()
