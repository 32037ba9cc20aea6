"""Exposure compensation: a color gain per training camera (not in the paper).

Cameras of a rig differ in exposure and white balance. Without correction, training
explains the differences by view-dependent color, which is wrong in all other directions.
Every training camera therefore has gains for red, green and blue, and training uses
pictures corrected to the mean camera. The stream contains no gains; its scene has the
exposure of the mean camera.
"""

from collections.abc import Iterable

import torch
from torch import Tensor
from torch.utils.weak import WeakTensorKeyDictionary

_MIN_GAIN, _MAX_GAIN = 0.5, 2.0
_SATURATED = 0.98
_APART = 4  # pixel step of the comparison in both directions
_MIN_LIGHT = 1e-6


class Exposures:
    """Gains of the training views, with a mean of 1.

    Args:
        view_count: Number of training views.
        device: Device that holds the pictures.

    Attributes:
        gains: `[V, 3]` gains of red, green and blue.
    """

    def __init__(self, view_count: int, device: torch.device) -> None:
        self.gains = torch.ones((view_count, 3), device=device)
        self._corrected = WeakTensorKeyDictionary()

    def correct(self, picture: Tensor, view: int) -> Tensor:
        """Correct a view's picture `[H, W, 3]` to the exposure of the mean camera.

        The result is cached until the gains change.
        """
        if picture not in self._corrected:
            self._corrected[picture] = picture / self.gains[view]
        corrected: Tensor = self._corrected[picture]
        return corrected

    def update_gain(self, view: int, image: Tensor, picture: Tensor, rate: float) -> None:
        """Update the gain of a view by an exponential moving average.

        Args:
            view: Index of the view.
            image: `[H, W, 3]` rendering.
            picture: `[H, W, 3]` picture of the camera.
            rate: Weight of the new value.
        """
        self.gains[view] = self.gains[view].lerp(estimate_gain(image, picture), rate)
        self._balance()

    def estimate_all(self, pairs: Iterable[tuple[Tensor, Tensor]]) -> None:
        """Estimate all gains again from pairs of rendering and picture."""
        self.gains = torch.stack([estimate_gain(image, picture) for image, picture in pairs])
        self._balance()

    def restore(self, gains: Tensor) -> None:
        """Restore gains `[V, 3]`."""
        self.gains = gains.to(self.gains)
        self._corrected = WeakTensorKeyDictionary()

    def _balance(self) -> None:
        """Normalize the mean gain to 1 and drop cached pictures."""
        self.gains /= self.gains.mean(dim=0)
        self._corrected = WeakTensorKeyDictionary()


def estimate_gain(image: Tensor, picture: Tensor) -> Tensor:
    """Estimate the `[3]` least-squares gains from an image to a picture.

    Saturated pixels are ignored, and a subset of the others is used.
    """
    image, picture = image.detach()[::_APART, ::_APART], picture.detach()[::_APART, ::_APART]
    shown = image * (picture < _SATURATED)
    light = (shown * image).sum(dim=(0, 1))
    gain = (shown * picture).sum(dim=(0, 1)) / light.clamp(min=_MIN_LIGHT)
    return torch.where(light > _MIN_LIGHT, gain, 1.0).clamp(_MIN_GAIN, _MAX_GAIN)
