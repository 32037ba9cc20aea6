"""Trainable Gaussians: raw attributes and their Adam state.

Densification removes and adds rows; remaining rows keep their Adam state.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.encoder.training.straight_through import (
    position_step,
    round_rotations,
    round_to_step,
)
from quarc_ref.format.records import StreamHeader
from quarc_ref.rendering.rasterizer import Gaussians, activate_opacities

ADAM_EPSILON = 1e-15
_ADAM_KNOWS = ("step", "exp_avg", "exp_avg_sq")
_MIN_OPACITY = 1e-5
_SH_C0 = 0.28209479177387814


@dataclass(frozen=True, slots=True, eq=False)
class Attributes:
    """Raw attributes in the form of 3DGS, one row per Gaussian.

    Attributes:
        means: `[N, 3]` positions, world units.
        rotations: `[N, 4]` quaternions wxyz of any norm.
        log_scales: `[N, 3]` natural logarithms of scales.
        opacities: `[N]` opacity logits.
        sh_dc: `[N, 1, 3]` SH coefficients of degree 0.
        sh_rest: `[N, 3, 3]` SH coefficients of degree 1.
    """

    means: Tensor
    rotations: Tensor
    log_scales: Tensor
    opacities: Tensor
    sh_dc: Tensor
    sh_rest: Tensor

    def rows(self, which: Tensor) -> "Attributes":
        """Return the rows of a mask or an index."""
        return Attributes(*(tensor[which] for tensor in self.tensors()))

    def joined(self, other: "Attributes") -> "Attributes":
        """Concatenate these rows and those of another object."""
        pairs = zip(self.tensors(), other.tensors(), strict=True)
        return Attributes(*(torch.cat(pair) for pair in pairs))

    def tensors(self) -> tuple[Tensor, ...]:
        """Return the tensors in the order of the attributes."""
        return (
            self.means,
            self.rotations,
            self.log_scales,
            self.opacities,
            self.sh_dc,
            self.sh_rest,
        )

    def detached(self) -> "Attributes":
        """Return detached copies."""
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
        """Return activated Gaussians for rendering."""
        return Gaussians(
            self.means,
            self.rotations,
            torch.exp(self.log_scales),
            activate_opacities(self.opacities),
            torch.cat([self.sh_dc, self.sh_rest], dim=1),
        )


_NAMES = tuple(field.name for field in fields(Attributes))


def from_splats(splats: Splats, device: torch.device) -> Attributes:
    """Return the attributes of a decoded scene; SH degree 1 is 0 if the stream has none."""
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
    """Attributes and an Adam optimizer whose rows can be replaced.

    Args:
        attributes: Initial attributes.
        rates: Learning rate of each attribute, in the order of `Attributes`.
    """

    def __init__(self, attributes: Attributes, rates: tuple[float, ...]) -> None:
        self._leaves = [_leaf(tensor) for tensor in attributes.tensors()]
        groups = [
            {"params": [leaf], "lr": rate} for leaf, rate in zip(self._leaves, rates, strict=True)
        ]
        self._adam = torch.optim.Adam(groups, eps=ADAM_EPSILON, fused=True)

    @property
    def attributes(self) -> Attributes:
        """The attributes as leaves of the autograd graph."""
        return Attributes(*self._leaves)

    @property
    def count(self) -> int:
        """Number of Gaussians."""
        return int(self._leaves[0].shape[0])

    def set_learning_rates(self, rates: Iterable[float]) -> None:
        """Change the learning rates, in the order of `Attributes`."""
        for group, rate in zip(self._adam.param_groups, rates, strict=True):
            group["lr"] = rate

    def step(self, loss: Tensor, extra: Tensor) -> Tensor:
        """Take an optimizer step; return the gradient with respect to an additional tensor."""
        *gradients, by_extra = torch.autograd.grad(loss, [*self._leaves, extra], allow_unused=True)
        for leaf, gradient in zip(self._leaves, gradients, strict=True):
            leaf.grad = gradient
        self._adam.step()
        return by_extra

    def decay_opacity(self, which: Tensor, share: float) -> None:
        """Decay the opacity of the Gaussians of a mask `[N]`."""
        logits = self._leaves[_NAMES.index("opacities")].detach()
        faded = torch.sigmoid(logits) * (1 - share)
        logits.copy_(torch.where(which, torch.logit(faded, eps=_MIN_OPACITY), logits))

    def state(self) -> dict[str, Tensor]:
        """Return the training state: attributes and Adam state."""
        state = {}
        for name, leaf in zip(_NAMES, self._leaves, strict=True):
            state[name] = leaf.detach()
            known = self._adam.state.get(leaf) or _initial_adam_state(leaf)
            state |= {f"{name}.{part}": known[part] for part in _ADAM_KNOWS}
        return state

    def restore(self, state: dict[str, Tensor]) -> None:
        """Restore a training state returned by `state`."""
        device = self._leaves[0].device
        self._leaves = [_leaf(state[name].to(device)) for name in _NAMES]
        self._adam.state.clear()
        groups = zip(_NAMES, self._leaves, self._adam.param_groups, strict=True)
        for name, leaf, group in groups:
            group["params"] = [leaf]
            self._adam.state[leaf] = {
                part: state[f"{name}.{part}"].to(device) for part in _ADAM_KNOWS
            }

    def replace_rows(self, kept: Tensor, added: Attributes) -> None:
        """Keep the rows of a mask `[N]`, and append rows with zero Adam state."""
        new = zip(self._adam.param_groups, added.tensors(), strict=True)
        leaves = []
        for group, rows in new:
            old = group["params"][0]
            leaf = _leaf(torch.cat([old.detach()[kept], rows]))
            state = self._adam.state.pop(old, None)
            if state is not None:
                for moment in ("exp_avg", "exp_avg_sq"):
                    state[moment] = torch.cat([state[moment][kept], torch.zeros_like(rows)])
                self._adam.state[leaf] = state
            group["params"] = [leaf]
            leaves.append(leaf)
        self._leaves = leaves


def to_sh_dc(colors: Tensor) -> Tensor:
    """Convert colors from 0 to 1 to SH DC coefficients (SPEC 10.2)."""
    return (colors - 0.5) / _SH_C0


def cosine_decay(step: int, iterations: int, end: float) -> float:
    """Return the cosine decay factor of a step: 1 at the first step, `end` after the last."""
    turn = (1 + math.cos(math.pi * step / iterations)) / 2
    return end + (1 - end) * turn


def _initial_adam_state(leaf: Tensor) -> dict[str, Tensor]:
    """Return the initial Adam state of an attribute."""
    nothing = torch.zeros_like(leaf, requires_grad=False)
    return {"step": torch.zeros((), device=leaf.device), "exp_avg": nothing, "exp_avg_sq": nothing}


def _leaf(tensor: Tensor) -> Tensor:
    return tensor.detach().clone().contiguous().requires_grad_()
