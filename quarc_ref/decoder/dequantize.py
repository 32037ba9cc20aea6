"""Converts the integer state to floats for rendering: SPEC 10.

The decoder uses floats only here. Each float is computed from the state with a single
rounding. Floats are never used to decode the next frame.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.scene import Scene
from quarc_ref.format.arrays import Int16, Int32
from quarc_ref.format.constants import ROTATION_FRACTION_BITS, SH_DC_PLANES
from quarc_ref.format.records import LOG_SCALES, OPACITY, SH_DC, SH_REST

Float32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Splats:
    """A scene as floats, one row per Gaussian; attributes are not activated, as in 3DGS files.

    Attributes:
        positions: `[N, 3]` positions xyz, world units.
        rotations: `[N, 4]` quaternions wxyz, whose length differs from 1 by at most 2^-21.
        log_scales: `[N, 3]` natural logarithms of the standard deviations in world units.
        opacities: `[N]` opacity logits.
        sh: `[N, k, 3]` SH coefficients of red, green and blue; k is 1 at degree 0, 4 at degree 1.
    """

    positions: Float32
    rotations: Float32
    log_scales: Float32
    opacities: Float32
    sh: Float32


def dequantize(scene: Scene) -> Splats:
    """Return the dequantized values of a scene (SPEC 10.1)."""
    header, codes = scene.header, scene.codes
    sh_dc = _scale_planes(codes[SH_DC], header.sh_dc_step)
    sh = np.hstack([sh_dc, _scale_planes(codes[SH_REST], header.sh_rest_step)])
    return Splats(  # [10.1-1]
        positions=_scale_planes(scene.positions, 2.0**-header.lattice_exponent),
        rotations=_scale_planes(scene.rotations, 2.0**-ROTATION_FRACTION_BITS),
        log_scales=_scale_planes(codes[LOG_SCALES], header.log_scale_step),
        opacities=_scale_planes(codes[OPACITY], header.opacity_step)[:, 0],
        sh=sh.reshape(scene.count, -1, SH_DC_PLANES),
    )


def _scale_planes(planes: Int16 | Int32, step: float) -> Float32:
    """Return the `[N, r]` products of planes `[r, N]` and a step, which are exact in float32."""
    scaled: Float32 = planes.T.astype(np.float32) * np.float32(step)
    return np.ascontiguousarray(scaled)
