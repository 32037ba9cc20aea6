"""Chooses the lattice and the quantization steps of a stream from error bounds.

The position step equals the bound. Rounding causes errors of up to half a step, so half of the
bound remains for changes between frames that are too small to be coded. If the input values are
already multiples of a suitable step, that step is used, and the values are coded exactly.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.encoder.rotations import (
    angles_between,
    code_quaternions,
    decode_quaternions,
    normalize,
)
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.grids import (
    find_common_divisor,
    find_lattice,
    find_step,
    greatest_common_divisor,
)
from quarc_ref.encoder.scenes.matching import Match
from quarc_ref.format.constants import (
    LATTICE_EXPONENT_LIMIT,
    POSITION_LIMIT,
    ROTATION_BITS_LIMIT,
    ROTATION_UNITY_LIMIT,
    STEP_LIMIT,
)
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import LATTICE_STEP_LIMIT, StreamHeader

_MIN_UNITS_PER_STEP = 8
_MIN_STEP = float(np.finfo(np.float32).tiny)
# range of the lattice, relative to the first frames, for Gaussians that move farther
_RANGE_FACTOR = 2
_MIN_ROTATION_BITS = 5
# Step relative to the bound: rounding uses 0.8 of the bound and leaves 0.2 for changes between
# frames that are too small to be coded.
_STEP_PER_BOUND = 1.6
_MAX_EXACT_ANGLE = 1e-5  # radians
# Largest error of a coded rotation, in radians times 2^bits. Each of three components has an error
# of half a step at most; the fourth is at least 1/2, so the error of the quaternion is at most
# twice theirs, and the angle is twice that error.
_MAX_STEPS_OF_ANGLE = 2 * math.sqrt(3)


def choose_steps(
    header: StreamHeader,
    bounds: Bounds,
    frames: Sequence[Splats],
    matches: Sequence[Match],
    first_frame: int = 0,
) -> StreamHeader:
    """Return a header with a lattice and steps that allow coding within the bounds.

    Args:
        header: Header that provides all other fields.
        bounds: Bounds that `Bounds.resolved` returned.
        frames: The first frames of the input, at least one.
        matches: Match of each frame with the next frame.
        first_frame: Number of the first frame in messages.

    Raises:
        EncodeError: The position bound is too small for the extent of the scene.
    """
    splats, sh = frames[0], frames[0].sh
    exponent = find_lattice([frame.positions for frame in frames], POSITION_LIMIT / _RANGE_FACTOR)
    if exponent is None or 2.0**-exponent > bounds.position:
        header = _choose_fine_lattice(header, bounds, frames, first_frame)
    else:
        header = replace(header, lattice_exponent=exponent)
        header = _choose_position_steps(header, bounds, frames, matches)
    return replace(
        header,
        rotation_bits=_choose_rotation_bits(splats.rotations, bounds.rotation),
        rotation_unity=math.ceil(min(ROTATION_UNITY_LIMIT, math.sqrt(3) / bounds.rotation * 1.02)),
        log_scale_step=_choose_step(splats.log_scales, bounds.log_scale),
        opacity_step=_choose_step(splats.opacities, bounds.opacity),
        sh_dc_step=_choose_step(sh[:, 0], bounds.sh_dc),
        sh_rest_step=_choose_step(sh[:, 1:4], bounds.sh_rest),
        sh_degree=int(sh.shape[1] > 1),
    )


def _choose_position_steps(
    header: StreamHeader, bounds: Bounds, frames: Sequence[Splats], matches: Sequence[Match]
) -> StreamHeader:
    """Return a header with steps for its lattice, which contains all positions."""
    units_per_world_unit = 2.0**header.lattice_exponent
    max_step = int(min(2 * bounds.position * units_per_world_unit, LATTICE_STEP_LIMIT))
    position_divisor = greatest_common_divisor(
        frames[0].positions.astype(np.float64) * units_per_world_unit
    )
    motions = [
        (
            current.positions[match.second_rows]
            - previous.positions[match.first_rows].astype(np.float64)
        )
        for previous, current, match in zip(frames, frames[1:], matches, strict=False)
    ]
    translation_divisor = find_common_divisor(
        np.concatenate([*motions, np.zeros((1, 3))]) * units_per_world_unit, max_step
    )
    default_step = max(1, max_step // 2)
    return replace(
        header,
        position_step=_choose_divisor(position_divisor, max_step, default_step),
        translation_step=_choose_divisor(translation_divisor, max_step, default_step),
    )


def _choose_fine_lattice(
    header: StreamHeader, bounds: Bounds, frames: Sequence[Splats], first_frame: int
) -> StreamHeader:
    """Return a header whose lattice and steps keep position errors within their bound.

    Raises:
        EncodeError: No lattice covers the positions and is fine enough for the bound.
    """
    largest = [float(np.abs(frame.positions).max()) for frame in frames]
    max_coordinate = max(largest) * _RANGE_FACTOR
    range_exponent = (
        math.floor(math.log2(POSITION_LIMIT / max_coordinate))
        if max_coordinate
        else LATTICE_EXPONENT_LIMIT
    )
    precision_exponent = math.log2(_MIN_UNITS_PER_STEP / bounds.position)
    exponent = max(0, math.ceil(min(precision_exponent, range_exponent, LATTICE_EXPONENT_LIMIT)))
    step_units = math.floor(bounds.position * 2.0**exponent)
    if step_units < 1:
        index = int(np.argmax(largest))
        row = np.abs(frames[index].positions).max(axis=1).argmax()
        message = (
            f"frame {first_frame + index}: a stream cannot represent the position of Gaussian {row}"
            f", {largest[index]:.6g} units from the origin, with errors of at most "
            f"{bounds.position:.6g}: remove the Gaussian, or allow larger errors of position"
        )
        raise EncodeError(message)
    step = min(step_units, LATTICE_STEP_LIMIT)
    return replace(header, lattice_exponent=exponent, position_step=step, translation_step=step)


def _choose_divisor(divisor: int, max_step: int, default_step: int) -> int:
    """Return a detected divisor as the step, or `default_step` if it is too coarse or too fine."""
    return divisor if default_step / 16 <= divisor <= max_step else default_step


def _choose_step(values: NDArray[np.floating], bound: float) -> float:
    detected_step = find_step(values, 0.8 * bound)
    step = (
        detected_step
        if detected_step is not None and detected_step <= 2 * bound
        else _STEP_PER_BOUND * bound
    )
    return float(np.float32(min(max(step, _MIN_STEP), STEP_LIMIT)))


def _choose_rotation_bits(rotations: NDArray[np.floating], bound: float) -> int:
    """Return the number of fraction bits for rotations.

    The result is the smallest number of bits for which coding of the first frame is exact, or one
    bit more than the bound requires there, whichever is smaller. It is raised if a rotation that
    is not in the first frame, such as that of a birth, could exceed the bound.
    """
    unit_quaternions = normalize(rotations.T.astype(np.float64))
    max_errors = {}
    for bits in range(_MIN_ROTATION_BITS, ROTATION_BITS_LIMIT + 1):
        decoded = decode_quaternions(code_quaternions(unit_quaternions, bits), bits)
        max_errors[bits] = float(angles_between(decoded, unit_quaternions).max())
    exact_bits = [bits for bits, error in max_errors.items() if error < _MAX_EXACT_ANGLE]
    sufficient_bits = [bits for bits, error in max_errors.items() if error <= 0.9 * bound]
    chosen = min([*exact_bits, *sufficient_bits[1:2]] or sufficient_bits or [ROTATION_BITS_LIMIT])
    return max(chosen, math.ceil(min(math.log2(_MAX_STEPS_OF_ANGLE / bound), ROTATION_BITS_LIMIT)))
