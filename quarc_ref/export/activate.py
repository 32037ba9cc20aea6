"""Activates the attributes of splats, which 3DGS stores before activation (SPEC 10.1, 10.2)."""

import numpy as np

from quarc_ref.decoder.dequantize import Float32, Splats
from quarc_ref.format.constants import SH_C0

_MAX_LOG_SCALE = 80.0  # scales from 2e-35 to 6e34, with which float32 can still calculate


def compute_opacities(splats: Splats) -> Float32:
    """Return the `[N]` opacities from 0 to 1."""
    with np.errstate(over="ignore"):  # opacities below 1e-308 become 0
        opacities = 1 / (1 + np.exp(-splats.opacities.astype(np.float64)))
    return opacities.astype(np.float32)


def compute_scales(splats: Splats) -> Float32:
    """Return the `[N, 3]` standard deviations in world units, finite and above 0."""
    scales: Float32 = np.exp(np.clip(splats.log_scales, -_MAX_LOG_SCALE, _MAX_LOG_SCALE))
    return scales


def compute_base_colors(splats: Splats) -> Float32:
    """Return the `[N, 3]` colors given by SH DC alone, clamped to the range from 0 to 1."""
    colors: Float32 = np.clip(0.5 + SH_C0 * splats.sh[:, 0], 0, 1).astype(np.float32)
    return colors


def convert_to_xyzw(rotations: Float32) -> Float32:
    """Convert quaternions `[N, 4]` wxyz to unit quaternions xyzw."""
    unit_quaternions = rotations / np.linalg.norm(rotations, axis=1, keepdims=True)
    return np.ascontiguousarray(np.roll(unit_quaternions, -1, axis=1))
