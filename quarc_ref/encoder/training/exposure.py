"""Exposure compensation: estimates color gains of the training cameras (not in the paper).

The cameras of a rig differ in exposure and white balance. Without correction, training
models the differences as view-dependent color, which is wrong for novel views. Every
training camera therefore has gains for red, green and blue, and training uses pictures
corrected to the median gain of all cameras. The stream contains no gains; its scene has the
median exposure, which is close to that of most cameras even if a few differ greatly.

Exposures can change over time (automatic exposure, flickering lamps). In later frames, the pictures
are therefore compared with the previous decoded scene before its motion is trained. The scene
follows a change that most cameras see, because it changes the median.
"""

from collections.abc import Iterable

import torch
from torch import Tensor
from torch.utils.weak import WeakTensorKeyDictionary

_MIN_GAIN, _MAX_GAIN = 0.5, 2.0
_SATURATION_LEVEL = 0.98
_PIXEL_STRIDE = 4
_MIN_ENERGY = 1e-6
# Logarithm of the largest change of a gain that may be an error of its estimate. Where nothing
# changes, estimates for successive frames differ by about a tenth of this.
_MAX_NOISE = 0.01


class Exposures:
    """Color gains of the training views, normalized to a median of 1.

    Args:
        view_count: Number of training views.
        device: Device that holds the pictures.

    Attributes:
        gains: `[V, 3]` gains of red, green and blue.
        previous_gains: `[V, 3]` gains before the last call of `follow`: those of the frame before.
    """

    def __init__(self, view_count: int, device: torch.device) -> None:
        self.gains = torch.ones((view_count, 3), device=device)
        self.previous_gains = self._first_gains = self.gains
        self._corrected_pictures = WeakTensorKeyDictionary()

    def correct(self, picture: Tensor, view: int) -> Tensor:
        """Divide a view's picture `[H, W, 3]` by the gains of the view.

        The corrected picture is cached until the gains change.
        """
        if picture not in self._corrected_pictures:
            self._corrected_pictures[picture] = picture / self.gains[view]
        corrected: Tensor = self._corrected_pictures[picture]
        return corrected

    def white(self, view: int) -> Tensor:
        """Return the `[3]` colors of white in corrected pictures of a view."""
        return 1 / self.gains[view]

    def update_gain(self, view: int, image: Tensor, picture: Tensor, weight: float) -> None:
        """Update the exponential moving average of the gains of a view.

        Args:
            view: Index of the view.
            image: Rendering, `[H, W, 3]` or some of its pixels, `[P, 3]`.
            picture: Picture of the camera, likewise.
            weight: Weight of the new estimate in the average, 0 to 1.
        """
        self.gains[view] = self.gains[view].lerp(estimate_gain(image, picture), weight)
        self._normalize_gains()

    def estimate_all(self, pairs: Iterable[tuple[Tensor, Tensor]]) -> None:
        """Replace the gains of every view with an estimate from its rendering and its picture.

        Gains that cannot be estimated, for example those of a black picture, become 1.

        Args:
            pairs: For each view, rendering and picture of frame 0, `[H, W, 3]` or `[P, 3]`.
        """
        self.gains = torch.stack([estimate_median_gain(*pair) for pair in pairs])
        self._normalize_gains()
        self.gains = self.previous_gains = self._first_gains = self.gains.nan_to_num(1)

    def follow(self, pairs: Iterable[tuple[Tensor, Tensor]]) -> None:
        """Change the gains of `estimate_all` to those of a later frame.

        Changes of up to 1 % may be errors of the estimate and are ignored; larger changes are
        reduced by 1 %. Gains that cannot be estimated remain those of `estimate_all`.

        Args:
            pairs: For each view, rendering of the previous frame, and picture, `[H, W, 3]` or
                `[P, 3]`.
        """
        self.previous_gains = self.gains
        self.gains = torch.stack([estimate_median_gain(*pair) for pair in pairs])
        self._normalize_gains()
        changes = torch.log(self.gains / self._first_gains).nan_to_num(0)
        self.gains = self._first_gains * torch.nn.functional.softshrink(changes, _MAX_NOISE).exp()

    def restore(self, gains: Tensor) -> None:
        """Replace the gains with `[V, 3]` gains from a checkpoint."""
        self.gains = gains.to(self.gains)
        self._corrected_pictures = WeakTensorKeyDictionary()

    def _normalize_gains(self) -> None:
        """Normalize the median gain to 1 and clear the cache of corrected pictures."""
        self.gains /= self.gains.nanquantile(0.5, dim=0)
        self._corrected_pictures = WeakTensorKeyDictionary()


def estimate_gain(image: Tensor, picture: Tensor) -> Tensor:
    """Estimate the `[3]` gains that scale a rendering to a picture with the least squared error.

    Of images, only every fourth pixel in both directions is used. Saturated pixels are ignored.
    """
    image, picture = _sample_pixels(image), _sample_pixels(picture)
    unsaturated_image = image * (picture < _SATURATION_LEVEL)
    energy = (unsaturated_image * image).sum(dim=0)
    gains = (unsaturated_image * picture).sum(dim=0) / energy.clamp(min=_MIN_ENERGY)
    return torch.where(energy > _MIN_ENERGY, gains, 1.0).clamp(_MIN_GAIN, _MAX_GAIN)


def estimate_median_gain(image: Tensor, picture: Tensor) -> Tensor:
    """Estimate the `[3]` gains that scale a rendering to a picture with the least absolute error.

    These are medians of the ratios of the pixels, weighted by the rendering. Parts of the picture
    that have moved or changed hardly affect them. The pixels are those of `estimate_gain`. Gains
    that cannot be estimated are NaN.
    """
    image, picture = _sample_pixels(image), _sample_pixels(picture)
    if not len(image):
        return image.new_full((3,), torch.nan)
    weights = image.clamp(min=0) * (picture < _SATURATION_LEVEL)
    ratios, order = (picture / image.clamp(min=_MIN_ENERGY)).sort(dim=0)
    weight_sums = weights.gather(0, order).double().cumsum(dim=0)
    total_weights = weight_sums[-1]
    medians = (weight_sums < total_weights / 2).sum(dim=0).clamp(max=len(ratios) - 1)
    gains = ratios.gather(0, medians[None])[0]
    return torch.where(total_weights > _MIN_ENERGY, gains, torch.nan).clamp(_MIN_GAIN, _MAX_GAIN)


def _sample_pixels(image: Tensor) -> Tensor:
    """Return `[P, 3]` pixels of an image `[H, W, 3]`, evenly spaced, or `[P, 3]` pixels as is."""
    if image.ndim == 2:
        return image.detach()
    return image.detach()[::_PIXEL_STRIDE, ::_PIXEL_STRIDE].reshape(-1, 3)
