"""Converts trained floats to the integers of the format.

Rounding uses the same operations as training (`straight_through`). Values outside the range
of the format are not clamped; they raise EncodeError.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from quarc_ref.decoder.scene import Scene
from quarc_ref.encoder.requantize import find_representable
from quarc_ref.encoder.training.straight_through import position_step, split_rotations
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import CODE_LIMIT, POSITION_LIMIT
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import Births, Gaussians, StreamHeader

_ROUNDING_LIMIT = 2.0**62  # above all limits of the format, but within int64


def quantize_gaussians(attributes: Attributes, header: StreamHeader) -> Gaussians:
    """Quantize attributes with the quantization steps of a stream.

    Raises:
        EncodeError: An attribute is not finite, or out of the format's range.
    """
    for tensor in attributes.tensors():
        _require_finite(tensor, "an attribute")
    unit_quaternions = torch.nn.functional.normalize(attributes.rotations, dim=1)
    largest_indices, components = split_rotations(unit_quaternions, header.rotation_bits)
    codes = [
        _round_to_steps(attributes.log_scales, header.log_scale_step),
        _round_to_steps(attributes.opacities[:, None], header.opacity_step),
        _round_to_steps(attributes.sh_dc.flatten(1), header.sh_dc_step),
    ]
    if header.sh_degree:
        codes.append(_round_to_steps(attributes.sh_rest.flatten(1), header.sh_rest_step))
    return Gaussians(
        _round_to_steps(attributes.means, position_step(header)),
        np.concatenate([_to_integer_rows(largest_indices[:, None]), _to_integer_rows(components)]),
        _require_within(np.concatenate(codes), CODE_LIMIT, "an attribute"),
    )


def drop_unrepresentable(attributes: Attributes, header: StreamHeader) -> Attributes:
    """Return the Gaussians whose positions a canonical frame can represent (SPEC 5.4).

    The lattice limits positions, and the Gaussians of a frame must fit into a box
    (`requantize.find_representable`). Usually, only a few outliers are dropped.

    Raises:
        EncodeError: No Gaussian remains.
    """
    positions_in_steps = attributes.means / position_step(header)
    is_on_lattice = (positions_in_steps.abs() <= _max_position_steps(header)).all(dim=1)
    if not bool(is_on_lattice.any()):
        message = (
            "the positions of all trained Gaussians exceed the range of the format: move the "
            "origin of the capture's poses and points into the scene"
        )
        raise EncodeError(message)
    attributes = attributes.rows(is_on_lattice)
    is_kept = find_representable(_round_to_steps(attributes.means, position_step(header)))
    return attributes.rows(torch.from_numpy(is_kept).to(attributes.means.device))


def find_representable_births(attributes: Attributes, parents: Tensor, scene: Scene) -> Tensor:
    """Return a mask `[n]` of the new Gaussians whose positions a frame can represent (SPEC 7.6).

    The lattice and the distance from the parent are limited.

    Args:
        attributes: Attributes of the new Gaussians.
        parents: `[n]` index of each new Gaussian's parent in the scene.
        scene: Scene after the motion of the frame.
    """
    header = scene.header
    offsets = _measure_offsets(attributes.means, parents.cpu().numpy(), scene)
    is_too_far = torch.round(offsets / position_step(header)).abs() > CODE_LIMIT
    is_off_lattice = attributes.means.abs() > _max_position_steps(header) * position_step(header)
    # Positions that are not finite stay, because `quantize_births` reports them.
    return ~(is_too_far | is_off_lattice).any(dim=1)


def quantize_births(attributes: Attributes, parents: Int64, scene: Scene) -> Births:
    """Quantize new Gaussians relative to their parents, and sort them by parent index.

    Args:
        attributes: Attributes of the new Gaussians.
        parents: `[n]` index of each new Gaussian's parent in the scene.
        scene: Scene after the motion of the frame.

    Raises:
        EncodeError: An attribute is not finite, or out of the format's range.
    """
    order = np.argsort(parents, kind="stable")
    rows = torch.from_numpy(order).to(attributes.means.device)
    parents = parents[order]
    gaussians = quantize_gaussians(attributes.rows(rows), scene.header)
    offsets = _measure_offsets(attributes.means[rows], parents, scene)
    offset_steps = _round_to_steps(offsets, position_step(scene.header))
    coded_offsets = _require_within(offset_steps, CODE_LIMIT, "the position of a new Gaussian")
    return Births(parents, Gaussians(coded_offsets, gaussians.rotations, gaussians.codes))


def quantize_residuals(residuals: Tensor, step: float) -> Int64:
    """Return the symbols `[c, a]` of residuals `[a, c]`: residuals divided by `step`, rounded.

    Raises:
        EncodeError: A residual is not finite.
    """
    _require_finite(residuals, "a motion residual")
    return _round_to_steps(residuals, step)


def _measure_offsets(means: Tensor, parents: Int64, scene: Scene) -> Tensor:
    """Return the `[n, 3]` offsets of new Gaussians from their parents in world units."""
    return means - torch.tensor(_world_positions(scene, parents)).to(means)


def _max_position_steps(header: StreamHeader) -> int:
    """Return the largest coordinate in position steps that is on the lattice after rounding."""
    return POSITION_LIMIT // header.position_step - 1


def _world_positions(scene: Scene, indices: Int64) -> NDArray[np.float64]:
    """Return the `[n, 3]` positions of the Gaussians at `indices` in world units."""
    lattice_unit = 2.0**-scene.header.lattice_exponent
    world_positions: NDArray[np.float64] = scene.positions[:, indices].T * np.float64(lattice_unit)
    return world_positions


def _round_to_steps(values: Tensor, step: float) -> Int64:
    return _to_integer_rows(torch.round(values / step).clamp(-_ROUNDING_LIMIT, _ROUNDING_LIMIT))


def _to_integer_rows(values: Tensor) -> Int64:
    """Convert integral floats `[n, c]` to integers `[c, n]`."""
    rows: Int64 = np.ascontiguousarray(values.detach().cpu().numpy().T.astype(np.int64))
    return rows


def _require_finite(values: Tensor, description: str) -> None:
    if not bool(torch.isfinite(values).all()):
        message = f"training diverged: {description} is not finite"
        raise EncodeError(message)


def _require_within(values: Int64, limit: int, description: str) -> Int64:
    if np.any((values < -limit) | (values > limit)):
        message = f"{description} exceeds {limit} steps: use a larger quantization step"
        raise EncodeError(message)
    return values
