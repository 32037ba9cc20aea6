"""Straight-through quantizer: rounds forward, identity backward (paper Eq. 3).

Rounded values equal those that the decoder reconstructs, to float precision. The encoder
takes the state of a frame from the decoder, not from these values.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import torch
from torch import Tensor

from quarc_ref.format.records import StreamHeader

_rounds = ContextVar("rounds", default=True)


@contextmanager
def without_rounding() -> Iterator[None]:
    """Disable rounding within this context.

    Used to measure the loss of quality by rounding. The unrounded values cannot be written
    to a stream.
    """
    token = _rounds.set(False)
    try:
        yield
    finally:
        _rounds.reset(token)


def is_rounding() -> bool:
    """Whether rounding is enabled; see `without_rounding`."""
    return _rounds.get()


def round_to_step(values: Tensor, step: float) -> Tensor:
    """Round to multiples of a step with the gradient of the identity."""
    if not is_rounding():
        return values
    return values + (torch.round(values / step) * step - values).detach()


def round_rotations(quaternions: Tensor, fraction_bits: int) -> Tensor:
    """Normalize quaternions and round their three smaller components to the grid (SPEC 7.2).

    Args:
        quaternions: `[N, 4]` quaternions wxyz with any norm above 0.
        fraction_bits: Fraction bits of the three components.
    """
    unit = torch.nn.functional.normalize(quaternions, dim=1)
    if not is_rounding():
        return unit
    with torch.no_grad():
        index, components = split_rotations(unit, fraction_bits)
        others = components / (1 << fraction_bits)
        largest = torch.sqrt((1 - (others * others).sum(dim=1)).clamp(min=0))
        rounded = torch.empty_like(unit)
        rounded.scatter_(1, _places(index), torch.cat([largest[:, None], others], dim=1))
        rounded = rounded * torch.sign((rounded * unit).sum(dim=1, keepdim=True))
    return unit + (rounded - unit).detach()


def split_rotations(unit: Tensor, fraction_bits: int) -> tuple[Tensor, Tensor]:
    """Return the `[N]` index of the largest component, and the `[N, 3]` others in steps.

    The sign is chosen so that the largest component is positive.
    """
    index = unit.abs().argmax(dim=1)
    largest = unit.gather(1, index[:, None])
    others = unit.gather(1, _places(index)[:, 1:]) * torch.sign(largest)
    return index, torch.round(others * (1 << fraction_bits))


def position_step(header: StreamHeader) -> float:
    """Return the step of Gaussian positions in world units."""
    return float(header.position_step * 2.0**-header.lattice_exponent)


def translation_step(header: StreamHeader) -> float:
    """Return the step of translation residuals in world units."""
    return float(header.translation_step * 2.0**-header.lattice_exponent)


def _places(index: Tensor) -> Tensor:
    """Return `[N, 4]` indices: the largest component, then the others in order."""
    table = index.new_tensor([[0, 1, 2, 3], [1, 0, 2, 3], [2, 0, 1, 3], [3, 0, 1, 2]])
    return table[index]
