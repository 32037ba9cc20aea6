"""Names the axes of each Gaussian so that its codes take few bits.

A Gaussian does not change if its axes are renamed, or if two of them are reversed: 24 combinations
of a rotation and an order of the three scales represent the same Gaussian. They differ by the
rotations that map a cube onto itself.
"""

from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from torch import Tensor

from quarc_ref.encoder.rotations import Float64, code_quaternions, conjugate, multiply, normalize
from quarc_ref.encoder.training.code_rates import CodeRates
from quarc_ref.encoder.training.trainable import Attributes, to_columns, to_rows
from quarc_ref.format.arrays import Int64
from quarc_ref.format.records import StreamHeader

_CUBE_ROTATIONS = Rotation.create_group("O")
_QUATERNIONS = np.roll(_CUBE_ROTATIONS.as_quat(), 1, axis=1)  # wxyz
_AXES = np.abs(_CUBE_ROTATIONS.as_matrix()).argmax(axis=1)  # onto which each axis is rotated
_ROUNDS = 2
_MIN_SAVED_BITS = 1e-6


def rename_axes(attributes: Attributes, header: StreamHeader) -> tuple[Attributes, Tensor]:
    """Choose names for the axes of each Gaussian; the pictures stay the same.

    Args:
        attributes: Attributes of the Gaussians.
        header: Header of the stream, which contains the quantization steps.

    Returns:
        The attributes with renamed axes, and the `[N, 3]` former index of each axis.
    """
    rotations, log_scales = attributes.rotations, attributes.log_scales
    quaternions = to_columns(rotations)
    scale_codes = np.rint(to_columns(log_scales) / header.log_scale_step).astype(np.int64)
    choices = _choose_axes(normalize(quaternions), scale_codes, header.rotation_bits)
    axes = torch.from_numpy(_AXES[choices]).to(log_scales.device)
    rotated = to_rows(multiply(quaternions, _QUATERNIONS[choices].T), rotations)
    return replace(attributes, rotations=rotated, log_scales=log_scales.gather(1, axes)), axes


def _choose_axes(quaternions: Float64, scale_codes: Int64, rotation_bits: int) -> NDArray[np.intp]:
    """Return, for each Gaussian, the index of the cube rotation with the fewest bits, `[n]`.

    The bits depend on the codes of all Gaussians, so the choice is repeated. At first, each
    Gaussian has the axes that need the smallest rotation.
    """
    columns = np.arange(quaternions.shape[1])

    def code(choices: NDArray[np.intp]) -> Int64:
        rotated = multiply(quaternions, _QUATERNIONS[choices].T)
        codes = code_quaternions(rotated, rotation_bits)
        return np.concatenate([codes, scale_codes[_AXES[choices].T, columns]])

    half_angle_cosines = conjugate(_QUATERNIONS.T).T @ quaternions
    choices: NDArray[np.intp] = np.abs(half_angle_cosines).argmax(axis=0)
    for _ in range(_ROUNDS):
        rates = CodeRates(code(choices))
        bits = np.stack(
            [rates.bits(code(np.full_like(choices, k))) for k in range(len(_QUATERNIONS))]
        )
        best = bits.argmin(axis=0)
        saves_bits = bits[best, columns] < bits[choices, columns] - _MIN_SAVED_BITS
        choices = np.where(saves_bits, best, choices)
    return choices
