"""Sums of a rendered picture, whose derivatives show how each Gaussian affects the picture.

With random signs, the expected value of a squared derivative is the sum, over all pixels, of the
squared derivatives of the pixels (Hutchinson's estimator).
"""

import torch
from torch import Tensor

CHANNEL_COUNT = 3


def sum_with_signs(image: Tensor, generator: torch.Generator) -> Tensor:
    """Return the sum of the values of a picture with random signs."""
    signs = torch.randint(0, 2, image.shape, generator=generator) * 2 - 1
    return (image * signs.to(image)).sum()


def sum_weighted_by_error(image: Tensor, truth: Tensor) -> Tensor:
    """Return the sum of the pixels of a picture `[H, W, 3]`, weighted by their squared errors.

    Its derivative with respect to the brightness of a Gaussian is the error around the Gaussian.
    """
    squared_error = (image.detach() - truth).square().mean(dim=2)
    return (image.mean(dim=2) * squared_error).sum()
