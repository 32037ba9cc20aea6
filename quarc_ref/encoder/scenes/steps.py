"""Chooses the lattice and quantization steps for given Gaussians from error bounds.

A step equals the bound: rounding takes up to half of it, which leaves the other half for
changes between frames. If values are already on a suitable grid, its step is used, and
they remain exact.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.decoder.rotation import expand_rotations
from quarc_ref.encoder.requantize import code_rotations
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.grids import find_lattice, find_step, greatest_divisor, usual_divisor
from quarc_ref.encoder.scenes.matching import Match
from quarc_ref.encoder.scenes.rotations import angles_between, normalize
from quarc_ref.format.constants import (
    LATTICE_EXPONENT_LIMIT,
    POSITION_LIMIT,
    ROTATION_BITS_LIMIT,
    ROTATION_ONE,
    ROTATION_UNITY_LIMIT,
)
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import StreamHeader

_MIN_UNITS = 8
_ROOM = 2  # margin for Gaussians that move farther than in the first frames
_COARSEST_BITS = 5
_SHARE = 1.6  # step relative to the bound; the rest after rounding is for changes between frames
_EXACT = 1e-5  # radians


def choose_steps(
    header: StreamHeader, bounds: Bounds, frames: Sequence[Splats], matches: Sequence[Match]
) -> StreamHeader:
    """Return a header with a lattice and steps that keep the bounds.

    Args:
        header: Header with the other values.
        bounds: Bounds after `Bounds.resolved`.
        frames: The first frames, at least one.
        matches: Matches between each frame and the next.

    Raises:
        EncodeError: The bounds are too narrow for the extent of the scene.
    """
    first = frames[0]
    header = _choose_lattice(header, bounds, frames, matches)
    colors = first.sh
    return replace(
        header,
        rotation_bits=_choose_rotation_bits(first.rotations, bounds.rotation),
        rotation_unity=min(ROTATION_UNITY_LIMIT, math.ceil(math.sqrt(3) / bounds.rotation * 1.02)),
        log_scale_step=_choose_step(first.log_scales, bounds.log_scale),
        opacity_step=_choose_step(first.opacities, bounds.opacity),
        sh_dc_step=_choose_step(colors[:, 0], bounds.sh_dc),
        sh_rest_step=_choose_step(colors[:, 1:4], bounds.sh_rest),
        sh_degree=int(colors.shape[1] > 1),
    )


def _choose_lattice(
    header: StreamHeader, bounds: Bounds, frames: Sequence[Splats], matches: Sequence[Match]
) -> StreamHeader:
    exponent = find_lattice([each.positions for each in frames], POSITION_LIMIT / _ROOM)
    if exponent is not None and 2.0**-exponent <= bounds.position:
        scale = 2.0**exponent
        most = int(2 * bounds.position * scale)
        position = greatest_divisor(frames[0].positions.astype(np.float64) * scale)
        moved = [
            (after.positions[match.after] - before.positions[match.before].astype(np.float64))
            for before, after, match in zip(frames, frames[1:], matches, strict=False)
        ]
        translation = usual_divisor(np.concatenate([*moved, np.zeros((1, 3))]) * scale, most)
        half = max(1, most // 2)
        return replace(
            header,
            lattice_exponent=exponent,
            position_step=_choose_divisor(position, most, half),
            translation_step=_choose_divisor(translation, most, half),
        )
    reach = max(float(np.abs(each.positions).max()) for each in frames) * _ROOM
    finest = math.floor(math.log2(POSITION_LIMIT / reach)) if reach else LATTICE_EXPONENT_LIMIT
    wanted = math.ceil(math.log2(_MIN_UNITS / bounds.position))
    exponent = max(0, min(wanted, finest, LATTICE_EXPONENT_LIMIT))
    units = math.floor(bounds.position * 2.0**exponent)
    if units < 1:
        message = (
            f"positions reach {reach / _ROOM:.6g} units: errors of at most "
            f"{bounds.position:.6g} are finer than a stream can represent"
        )
        raise EncodeError(message)
    step = min(units, (1 << 16) - 1)
    return replace(header, lattice_exponent=exponent, position_step=step, translation_step=step)


def _choose_divisor(divisor: int, most: int, otherwise: int) -> int:
    """Return the step of a detected grid, unless it is too coarse or too fine."""
    return divisor if otherwise / 16 <= divisor <= most else otherwise


def _choose_step(values: NDArray[np.floating], bound: float) -> float:
    found = find_step(values, 0.8 * bound)
    step = found if found is not None and found <= 2 * bound else _SHARE * bound
    return float(np.float32(step))


def _choose_rotation_bits(rotations: NDArray[np.floating], bound: float) -> int:
    """Return the smallest number of fraction bits that keeps the rotation bound."""
    unit = normalize(rotations.T.astype(np.float64))
    fixed = np.rint(unit * ROTATION_ONE).astype(np.int64)
    errors = {}
    for bits in range(_COARSEST_BITS, ROTATION_BITS_LIMIT + 1):
        coded = expand_rotations(code_rotations(fixed, bits), bits)
        errors[bits] = float(angles_between(coded / ROTATION_ONE, unit).max())
    exact = [bits for bits, error in errors.items() if error < _EXACT]
    fitting = [bits for bits, error in errors.items() if error <= 0.9 * bound]
    return min([*exact, *fitting[1:2]] or fitting or [ROTATION_BITS_LIMIT])
