"""Activates the attributes of splats, which 3DGS stores before activation (SPEC 10.1, 10.2)."""

import numpy as np

from quarc_ref.decoder.dequantize import Float32, Splats

SH_C0 = 0.28209479177387814


def compute_opacities(splats: Splats) -> Float32:
    """Return the `[N]` opacities from 0 to 1."""
    opacities: Float32 = (1 / (1 + np.exp(-splats.opacities.astype(np.float64)))).astype(np.float32)
    return opacities


def compute_scales(splats: Splats) -> Float32:
    """Return the `[N, 3]` standard deviations in world units."""
    scales: Float32 = np.exp(splats.log_scales)
    return scales


def compute_base_colors(splats: Splats) -> Float32:
    """Return the `[N, 3]` colors given by SH DC alone, clamped to the range from 0 to 1."""
    colors: Float32 = np.clip(0.5 + SH_C0 * splats.sh[:, 0], 0, 1).astype(np.float32)
    return colors


def convert_to_xyzw(rotations: Float32) -> Float32:
    """Convert quaternions `[N, 4]` wxyz to unit quaternions xyzw."""
    unit_quaternions = rotations / np.linalg.norm(rotations, axis=1, keepdims=True)
    return np.ascontiguousarray(np.roll(unit_quaternions, -1, axis=1))
