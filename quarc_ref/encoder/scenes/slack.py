"""How much farther off than others a Gaussian may be: by how little an error of it shows.

A shift shows less in a Gaussian that is larger, a turn in one that is rounder, and both in one
that is fainter.
"""

from dataclasses import dataclass

import numpy as np

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.rotations import Float64
from quarc_ref.format.arrays import Int64

_LEAST_ELONGATION = 1e-3
_LEAST_OPACITY = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Slack:
    """Factors of the bounds of each Gaussian, 1 or more.

    Attributes:
        position: `[N]`.
        rotation: `[N]`.
    """

    position: Float64
    rotation: Float64

    def rows(self, which: Int64) -> "Slack":
        """Return those of some Gaussians."""
        return Slack(self.position[which], self.rotation[which])


def measure_slack(splats: Splats, bounds: Bounds) -> Slack:
    """Return the slack of the Gaussians of a frame.

    That of positions is the middle one of the three scales by the median scale of the first
    frame; that of rotations is 1 by the natural logarithm of the longest scale by the shortest.
    Both are divided by the opacity, and limited to `most_slack`.

    Args:
        splats: The frame.
        bounds: Settled.
    """
    scales = np.sort(splats.log_scales.astype(np.float64), axis=1)
    with np.errstate(over="ignore"):  # which the limits take care of
        opacities = 1 / (1 + np.exp(-splats.opacities.astype(np.float64)))
        size = np.exp(scales[:, 1]) / (bounds.size or 1.0)
    faint = 1 / np.maximum(opacities, _LEAST_OPACITY)
    roundness = 1 / np.maximum(scales[:, 2] - scales[:, 0], _LEAST_ELONGATION)
    return Slack(
        np.clip(size * faint, 1, bounds.most_slack),
        np.clip(roundness * faint, 1, bounds.most_slack),
    )
