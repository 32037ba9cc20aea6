"""Measures the quality of one camera's views, frame by frame."""

import numpy as np

from quarc_ref.evaluation.color_correction import (
    COLOR_CORRECTION,
    COLOR_CORRECTION_VARIANT,
    Correction,
)
from quarc_ref.evaluation.metrics import (
    MASK_VARIANT,
    PSNR_VARIANT,
    SSIM_VARIANT,
    Mask,
    Picture,
    measure_psnr,
    measure_ssim,
)
from quarc_ref.evaluation.regions import MOVING_VARIANT, find_moving_region
from quarc_ref.evaluation.views import View

Measures = dict[str, float | None]  # metrics by name; None if not measurable

FLICKER_VARIANT = (
    "flicker, truth_flicker: mean absolute difference, in 8-bit levels, between a frame and the "
    "previous frame of the rendering (flicker) or of the ground truth (truth_flicker), over "
    "pixels that are static in both frames"
)
VARIANTS = {
    "psnr": PSNR_VARIANT,
    "ssim": SSIM_VARIANT,
    "cc": COLOR_CORRECTION_VARIANT,
    "moving": MOVING_VARIANT,
    "flicker": FLICKER_VARIANT,
    "mask": MASK_VARIANT,
}


class CameraMeter:
    """Measures the views of one camera in temporal order.

    Args:
        background: `[H, W, 3]` background from `find_background`; if it is None, the metrics of the
            moving and static regions are None.
        correction: Color correction; the names of corrected metrics contain its prefix.
    """

    def __init__(
        self, background: Picture | None, correction: Correction = COLOR_CORRECTION
    ) -> None:
        self._background = background
        self._correction = correction
        self._previous_view_and_mask: tuple[View, Mask] | None = None

    def measure(self, view: View) -> Measures:
        """Return the metrics of a view.

        Returns:
            The metrics by name: `psnr`, `ssim`, `moving_psnr` and `static_psnr`, each with and
            without color correction, as well as `flicker` and `truth_flicker`. The names of
            corrected metrics contain the prefix of the correction, such as `moving_cc_psnr`.
            A metric is None if its region is empty or unknown. The flicker of the first frame
            is also None.
        """
        prefix = self._correction.prefix
        corrected = self._correct(view)
        metrics: Measures = {
            "psnr": view.psnr,
            "ssim": view.ssim,
            f"{prefix}_psnr": measure_psnr(corrected, view.truth, view.mask),
            f"{prefix}_ssim": measure_ssim(corrected, view.truth, view.mask),
        }
        moving_mask, static_mask = self._find_regions(view)
        for region, mask in (("moving", moving_mask), ("static", static_mask)):
            metrics[f"{region}_psnr"] = _measure_masked_psnr(mask, view.decoded, view.truth)
            metrics[f"{region}_{prefix}_psnr"] = _measure_masked_psnr(mask, corrected, view.truth)
        return metrics | self._measure_flicker(view, static_mask)

    def _correct(self, view: View) -> Picture:
        """Return the rendering after a color correction that is fitted to the unmasked pixels."""
        if view.mask is None:
            return self._correction.apply(view.decoded, view.truth)
        mask, corrected = view.mask, np.zeros_like(view.decoded)
        corrected[mask] = self._correction.apply(view.decoded[mask], view.truth[mask])
        return corrected

    def _find_regions(self, view: View) -> tuple[Mask | None, Mask | None]:
        """Return `[H, W]` masks of the unmasked moving pixels and the unmasked static pixels."""
        if self._background is None:
            return None, None
        moving_mask = find_moving_region(view.truth_levels, self._background, view.mask)
        if view.mask is None:
            return moving_mask, ~moving_mask
        return moving_mask & view.mask, ~moving_mask & view.mask

    def _measure_flicker(self, view: View, static_mask: Mask | None) -> Measures:
        previous_view_and_mask, self._previous_view_and_mask = (
            self._previous_view_and_mask,
            None if static_mask is None else (view, static_mask),
        )
        if previous_view_and_mask is None or static_mask is None:
            return {"flicker": None, "truth_flicker": None}
        previous_view, previous_static_mask = previous_view_and_mask
        if view.frame != previous_view.frame + 1:
            return {"flicker": None, "truth_flicker": None}
        static_mask = static_mask & previous_static_mask
        return {
            "flicker": _measure_change(static_mask, view.decoded, previous_view.decoded),
            "truth_flicker": _measure_change(static_mask, view.truth, previous_view.truth),
        }


def _measure_masked_psnr(mask: Mask | None, picture: Picture, truth: Picture) -> float | None:
    """Return the PSNR in dB over the pixels of a mask `[H, W]`; None if the mask is empty."""
    if mask is None or not mask.any():
        return None
    return measure_psnr(picture[mask], truth[mask])


def _measure_change(mask: Mask, picture: Picture, previous_picture: Picture) -> float | None:
    """Return the mean absolute difference in 8-bit levels over a mask; None for an empty mask."""
    if not mask.any():
        return None
    return 255 * float(np.abs(picture[mask] - previous_picture[mask]).mean(dtype=np.float64))
