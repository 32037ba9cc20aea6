"""Decoded frames to pictures, without torch: what evaluation and players draw with."""

import numpy as np

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.format.records import Camera
from quarc_ref.rendering.pipeline import (
    Drawn,
    Float32,
    bin_tiles,
    blank_picture,
    composite,
    project,
)

OPACITY_MOST = 0.99
SH_COEFFICIENTS = 4


def render_picture(splats: Splats, camera: Camera) -> Float32:
    """Return `[H, W, 3]` the picture that a camera sees, before a black background.

    Args:
        splats: A frame's scene in floats.
        camera: Gaussians nearer than a fraction of its near bound are not drawn (SPEC 10.3).
    """
    opacities = np.minimum(1 / (1 + np.exp(-splats.opacities)), np.float32(OPACITY_MOST))
    sh = np.zeros((splats.positions.shape[0], SH_COEFFICIENTS, 3), dtype=np.float32)
    sh[:, : splats.sh.shape[1]] = splats.sh
    scales = np.exp(splats.log_scales)
    drawn = Drawn(splats.positions, splats.rotations, scales, opacities, sh)
    projection = project(camera, drawn)
    tiles = bin_tiles(camera, projection)
    picture = blank_picture(camera)
    composite(projection, opacities, tiles, np.zeros(3, dtype=np.float32), picture)
    return picture.image
