"""Exposure compensation: a color gain per training camera (not in the paper).

Cameras of a rig differ in exposure and white balance. Without correction, training fits the
differences with view-dependent color that is wrong from all other directions. Here every training
camera has a gain for red, green and blue, and training compares with pictures as the mean camera
would have taken them. A stream carries no gains: its scene is the mean camera's.
"""

from collections.abc import Iterable

import torch
from torch import Tensor
from torch.utils.weak import WeakTensorKeyDictionary

_LEAST_GAIN, _MOST_GAIN = 0.5, 2.0
_SATURATED = 0.98
_APART = 4  # pixels from one that is compared to the next, both ways
_LEAST_LIGHT = 1e-6


class Exposures:
    """The gains of the training views, whose mean is 1.

    Args:
        view_count: Number of training views.
        device: Device that holds the pictures.

    Attributes:
        gains: `[V, 3]` of red, green and blue.
    """

    def __init__(self, view_count: int, device: torch.device) -> None:
        self.gains = torch.ones((view_count, 3), device=device)
        self._corrected = WeakTensorKeyDictionary()

    def correct(self, picture: Tensor, view: int) -> Tensor:
        """A view's picture `[H, W, 3]` with its exposure corrected to the mean camera's.

        The tensor is cached until the gains change.
        """
        if picture not in self._corrected:
            self._corrected[picture] = picture / self.gains[view]
        corrected: Tensor = self._corrected[picture]
        return corrected

    def observe(self, view: int, image: Tensor, picture: Tensor, rate: float) -> None:
        """Update a view's gain by an exponential moving average.

        Args:
            view: Index of the view.
            image: `[H, W, 3]` rendered view.
            picture: `[H, W, 3]` picture of the camera.
            rate: The share.
        """
        self.gains[view] = self.gains[view].lerp(estimate_gain(image, picture), rate)
        self._balance()

    def settle(self, pairs: Iterable[tuple[Tensor, Tensor]]) -> None:
        """Estimate all gains again, from pairs of rendering and picture."""
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
    """Least-squares gain from an image to a picture, `[3]`.

    Saturated pixels carry no information; a subset of the others is sufficient.
    """
    image, picture = image.detach()[::_APART, ::_APART], picture.detach()[::_APART, ::_APART]
    shown = image * (picture < _SATURATED)
    light = (shown * image).sum(dim=(0, 1))
    gain = (shown * picture).sum(dim=(0, 1)) / light.clamp(min=_LEAST_LIGHT)
    return torch.where(light > _LEAST_LIGHT, gain, 1.0).clamp(_LEAST_GAIN, _MOST_GAIN)
