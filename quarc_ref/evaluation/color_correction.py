"""Corrects the colors of a rendering before it is compared with the ground truth.

The encoder cannot know the exposure and white balance of held-out cameras, so metrics are
also measured after color correction. gsplat and Zip-NeRF do the same for cc_psnr, but with other
transforms, so figures are not comparable with theirs.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.evaluation.metrics import Picture

COLOR_CORRECTION_VARIANT = (
    "cc_*: measured after color correction, which fits the clamped rendering to the truth by "
    "least squares with one 3 x 4 affine RGB matrix per picture, and clamps the result"
)


@dataclass(frozen=True, slots=True)
class Correction:
    """A method of color correction.

    Attributes:
        prefix: Prefix in the names of corrected metrics, such as `cc` in `cc_psnr`.
        apply: Function that takes a rendering and the ground truth, both `[..., 3]` from 0 to 1,
            and returns the corrected rendering.
    """

    prefix: str
    apply: Callable[[Picture, Picture], Picture]


def correct_color(picture: Picture, truth: Picture) -> Picture:
    """Apply the affine RGB transform that fits a picture to the truth by least squares.

    Args:
        picture: `[H, W, 3]` picture from 0 to 1.
        truth: `[H, W, 3]` ground truth from 0 to 1.
    """
    colors, target = (image.reshape(-1, 3).astype(np.float64) for image in (picture, truth))
    colors_and_ones = np.column_stack((colors, np.ones(len(colors))))
    affine, *_ = np.linalg.lstsq(colors_and_ones.T @ colors_and_ones, colors_and_ones.T @ target)
    return _clamp_to_picture(colors_and_ones @ affine, picture)


def correct_gain(picture: Picture, truth: Picture) -> Picture:
    """Multiply red, green and blue by the gains that fit a picture to the truth by least squares.

    Args:
        picture: `[H, W, 3]` picture from 0 to 1.
        truth: `[H, W, 3]` ground truth from 0 to 1.
    """
    colors, target = (image.reshape(-1, 3).astype(np.float64) for image in (picture, truth))
    squared_sums = np.square(colors).sum(axis=0)
    gains = np.divide(
        (colors * target).sum(axis=0), squared_sums, out=np.ones(3), where=squared_sums > 0
    )
    return _clamp_to_picture(colors * gains, picture)


def _clamp_to_picture(colors: NDArray[np.float64], picture: Picture) -> Picture:
    clamped: Picture = np.clip(colors, 0, 1).astype(np.float32).reshape(picture.shape)
    return clamped


COLOR_CORRECTION = Correction("cc", correct_color)
GAIN_CORRECTION = Correction("gain", correct_gain)
