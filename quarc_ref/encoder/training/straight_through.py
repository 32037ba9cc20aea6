"""Straight-through quantizer: rounds, but has the gradient of the identity (paper Eq. 3).

Rounded values equal those that the decoder reconstructs, up to float precision. The encoder
takes the state of a frame from the decoder, not from the rounded values.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import torch
from torch import Tensor

from quarc_ref.format.records import StreamHeader
from quarc_ref.rendering.constants_on_device import make_constant

# Row k: component k of a quaternion, then the others in order.
_ORDER_TABLE = (0, 1, 2, 3, 1, 0, 2, 3, 2, 0, 1, 3, 3, 0, 1, 2)

_rounding_enabled = ContextVar("rounds", default=True)


@contextmanager
def without_rounding() -> Iterator[None]:
    """Disable rounding within this context.

    Use this context to measure how much quality is lost by rounding. Unrounded values cannot
    be written to a stream.
    """
    token = _rounding_enabled.set(False)
    try:
        yield
    finally:
        _rounding_enabled.reset(token)


def is_rounding() -> bool:
    """Return whether rounding is enabled; see `without_rounding`."""
    return _rounding_enabled.get()


def round_to_step(values: Tensor, step: float) -> Tensor:
    """Round values to multiples of a step, with the gradient of the identity."""
    if not is_rounding():
        return values
    return values + (torch.round(values / step) * step - values).detach()


def round_rotations(quaternions: Tensor, fraction_bits: int) -> Tensor:
    """Normalize quaternions and round their three smaller components to the grid (SPEC 7.2).

    Args:
        quaternions: `[N, 4]` quaternions wxyz of any norm above 0.
        fraction_bits: Number of fraction bits of the three components.
    """
    unit_quaternions = torch.nn.functional.normalize(quaternions, dim=1)
    if not is_rounding():
        return unit_quaternions
    with torch.no_grad():
        largest_indices, components = split_rotations(unit_quaternions, fraction_bits)
        smaller_components = components / (1 << fraction_bits)
        largest = torch.sqrt(
            (1 - (smaller_components * smaller_components).sum(dim=1)).clamp(min=0)
        )
        rounded = torch.empty_like(unit_quaternions)
        rounded.scatter_(
            1,
            _component_order(largest_indices),
            torch.cat([largest[:, None], smaller_components], dim=1),
        )
        rounded = rounded * torch.sign((rounded * unit_quaternions).sum(dim=1, keepdim=True))
    return unit_quaternions + (rounded - unit_quaternions).detach()


def split_rotations(unit_quaternions: Tensor, fraction_bits: int) -> tuple[Tensor, Tensor]:
    """Return the `[N]` indices of the largest components, and the `[N, 3]` others as step counts.

    The sign of each quaternion is chosen so that the largest component is positive.
    """
    largest_indices = unit_quaternions.abs().argmax(dim=1)
    largest = unit_quaternions.gather(1, largest_indices[:, None])
    smaller_components = unit_quaternions.gather(
        1, _component_order(largest_indices)[:, 1:]
    ) * torch.sign(largest)
    return largest_indices, torch.round(smaller_components * (1 << fraction_bits))


def position_step(header: StreamHeader) -> float:
    """Return the quantization step of Gaussian positions in world units."""
    return float(header.position_step * 2.0**-header.lattice_exponent)


def translation_step(header: StreamHeader) -> float:
    """Return the quantization step of translation residuals in world units."""
    return float(header.translation_step * 2.0**-header.lattice_exponent)


def _component_order(largest_indices: Tensor) -> Tensor:
    """Return `[N, 4]` component indices: the largest component, then the others in order."""
    order_table = make_constant(_ORDER_TABLE, largest_indices.device, largest_indices.dtype)
    return order_table.reshape(4, 4)[largest_indices]
