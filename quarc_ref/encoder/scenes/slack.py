"""Slack: factors that loosen the error bounds of Gaussians in which errors are less visible.

A shift is less visible in a larger Gaussian, and a rotation in a rounder Gaussian. Shifts and
rotations are less visible in a fainter Gaussian.
"""

from dataclasses import dataclass

import numpy as np

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.encoder.rotations import Float64
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.format.arrays import Int64

_MIN_ELONGATION = 1e-3
_MIN_OPACITY = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Slack:
    """Factors of at least 1 by which the error bounds of each Gaussian are multiplied.

    Attributes:
        position: `[N]` factors for positions.
        rotation: `[N]` factors for rotations.
    """

    position: Float64
    rotation: Float64

    def select(self, indices: Int64) -> "Slack":
        """Return the factors of the Gaussians at the given indices."""
        return Slack(self.position[indices], self.rotation[indices])


def measure_slack(splats: Splats, bounds: Bounds) -> Slack:
    """Return the slack of each Gaussian of a frame.

    The slack of the position is the middle one of the three scales, divided by the median scale
    of the first frame. The slack of the rotation is 1 / ln(largest scale / smallest scale). Both
    slacks are divided by the opacity and clamped to the range from 1 to `most_slack`.

    Args:
        splats: Gaussians of the frame.
        bounds: Bounds that `Bounds.resolved` returned.
    """
    log_scales = np.sort(splats.log_scales.astype(np.float64), axis=1)
    with np.errstate(over="ignore"):  # infinite values are clipped below
        opacities = 1 / (1 + np.exp(-splats.opacities.astype(np.float64)))
        relative_sizes = np.exp(log_scales[:, 1]) / (bounds.median_scale or 1.0)
    faintness = 1 / np.maximum(opacities, _MIN_OPACITY)
    roundness = 1 / np.maximum(log_scales[:, 2] - log_scales[:, 0], _MIN_ELONGATION)
    return Slack(
        np.clip(relative_sizes * faintness, 1, bounds.most_slack),
        np.clip(roundness * faintness, 1, bounds.most_slack),
    )
