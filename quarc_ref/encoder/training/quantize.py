"""Converts trained floats to the integers of the format.

Rounding uses the same operations as training (`straight_through`). Values out of the
format's range raise EncodeError instead of being clamped.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from quarc_ref.decoder.scene import Scene
from quarc_ref.encoder.training.straight_through import position_step, split_rotations
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import AXIS_BITS_LIMIT, CODE_LIMIT, POSITION_LIMIT
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import Births, Gaussians, StreamHeader

_FARTHEST = 2.0**62  # above all limits, but within int64


def quantize_gaussians(attributes: Attributes, header: StreamHeader) -> Gaussians:
    """Quantize attributes to the steps of a stream.

    Raises:
        EncodeError: A number is not finite, or out of the format's range.
    """
    for tensor in attributes.tensors():
        if not bool(torch.isfinite(tensor).all()):
            message = "training diverged: an attribute is not finite"
            raise EncodeError(message)
    unit = torch.nn.functional.normalize(attributes.rotations, dim=1)
    index, components = split_rotations(unit, header.rotation_bits)
    codes = [
        _steps(attributes.log_scales, header.log_scale_step),
        _steps(attributes.opacities[:, None], header.opacity_step),
        _steps(attributes.sh_dc.flatten(1), header.sh_dc_step),
    ]
    if header.sh_degree:
        codes.append(_steps(attributes.sh_rest.flatten(1), header.sh_rest_step))
    return Gaussians(
        _steps(attributes.means, position_step(header)),
        np.concatenate([_rows(index[:, None]), _rows(components)]),
        _require_within(np.concatenate(codes), CODE_LIMIT, "an attribute"),
    )


def drop_unrepresentable(attributes: Attributes, header: StreamHeader) -> Attributes:
    """Drop Gaussians whose positions a canonical frame cannot represent (SPEC 5.4).

    Gaussians outside the range of the lattice or the axis bits, usually a few outliers of
    training, are dropped.

    Raises:
        EncodeError: No Gaussian is left.
    """
    half = min(1 << (AXIS_BITS_LIMIT - 1), POSITION_LIMIT // header.position_step) - 1
    steps = attributes.means / position_step(header)
    kept = (steps.abs() <= half).all(dim=1)
    if not bool(kept.any()):
        message = "no trained Gaussian is within the range of the format"
        raise EncodeError(message)
    return attributes.rows(kept)


def quantize_births(attributes: Attributes, parents: Int64, scene: Scene) -> Births:
    """Quantize new Gaussians relative to their parents, in the order of the parents.

    Args:
        attributes: New Gaussians.
        parents: `[n]` indices of parents in the scene.
        scene: Scene after the motion of the frame.

    Raises:
        EncodeError: A number is not finite, or out of the format's range.
    """
    order = np.argsort(parents, kind="stable")
    rows = torch.from_numpy(order).to(attributes.means.device)
    parents = parents[order]
    gaussians = quantize_gaussians(attributes.rows(rows), scene.header)
    near = torch.tensor(_world(scene, parents)).to(attributes.means)
    offsets = attributes.means[rows] - near
    positions = _steps(offsets, position_step(scene.header))
    places = _require_within(positions, CODE_LIMIT, "the position of a new Gaussian")
    return Births(parents, Gaussians(places, gaussians.rotations, gaussians.codes))


def quantize_residuals(residuals: Tensor, step: float) -> Int64:
    """Return the symbols `[c, a]` of residuals `[a, c]`."""
    return _steps(residuals, step)


def _world(scene: Scene, indices: Int64) -> NDArray[np.float64]:
    """Return `[n, 3]` positions in world units."""
    unit = 2.0**-scene.header.lattice_exponent
    world: NDArray[np.float64] = scene.positions[:, indices].T * np.float64(unit)
    return world


def _steps(values: Tensor, step: float) -> Int64:
    return _rows(torch.round(values / step).clamp(-_FARTHEST, _FARTHEST))


def _rows(values: Tensor) -> Int64:
    """Convert integral floats `[n, c]` to integers `[c, n]`."""
    rows: Int64 = np.ascontiguousarray(values.detach().cpu().numpy().T.astype(np.int64))
    return rows


def _require_within(values: Int64, limit: int, what: str) -> Int64:
    if np.any((values < -limit) | (values > limit)):
        message = f"{what} exceeds {limit} steps: increase the step"
        raise EncodeError(message)
    return values
