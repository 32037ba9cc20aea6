"""Renders views of a decoded frame, and compares them with the pictures of the cameras."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quarc_ref.datasets.capture import Alpha, Capture, Image
from quarc_ref.decoder import Splats
from quarc_ref.evaluation.metrics import Mask, Picture, measure_psnr, measure_ssim
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.pictures import render_picture

_MIN_VISIBLE = 0.5 / 255


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A frame rendered for one camera, and its ground truth.

    Attributes:
        frame: Ordinal of the frame.
        camera: Name of the camera.
        truth_levels: `[H, W, 3]` ground truth in 8-bit levels.
        truth: `[H, W, 3]` ground truth from 0 to 1.
        decoded: `[H, W, 3]` rendering of the decoded scene from 0 to 1.
        psnr: PSNR, dB.
        ssim: SSIM (`ssim_inria`).
        mask: `[H, W]` mask of the pixels to use; None for all pixels. Masked pixels are
            black in `truth` and `decoded`.
    """

    frame: int
    camera: str
    truth_levels: Image
    truth: Picture
    decoded: Picture
    psnr: float
    ssim: float
    mask: Mask | None = None


def measure_views(
    splats: Splats,
    frame: int,
    cameras: Sequence[Camera],
    capture: Capture,
    indices: Sequence[int] | None = None,
) -> list[View]:
    """Render a frame for several cameras, and measure it against the ground truth.

    Args:
        splats: Splats of the frame.
        frame: Ordinal of the frame.
        cameras: Cameras for which to render, in the order of the capture. These may be the cameras
            of a stream, which are rounded and differ slightly from those of the capture.
        capture: Capture whose pictures are the ground truth.
        indices: Indices of the cameras to render; None for the held-out cameras.
    """
    camera_indices = capture.held_out if indices is None else indices
    views = []
    for index in camera_indices:
        picture = render_picture(splats, cameras[index])
        mask = select_pixels(picture, capture.mask(index, frame), capture.alpha(index, frame))
        truth_levels = capture.image(index, frame)
        views.append(make_view(frame, cameras[index].name, truth_levels, picture, mask))
    return views


def select_pixels(picture: Picture, mask: Mask | None, alpha: Alpha | None) -> Mask | None:
    """Return the `[H, W]` mask of the pixels to measure; None for all pixels.

    Args:
        picture: `[H, W, 3]` rendering before clamping.
        mask: Mask of the ground truth; None if all its pixels are used.
        alpha: Alpha of the ground truth; None if it is opaque. Otherwise, the pixels are measured
            that the ground truth or the rendering covers.
    """
    if alpha is None:
        return mask
    return np.asarray((alpha > 0) | (picture > _MIN_VISIBLE).any(axis=2))


def make_view(
    frame: int, camera: str, truth_levels: Image, picture: Picture, mask: Mask | None = None
) -> View:
    """Measure a rendering against an 8-bit picture; return a view with both and the metrics.

    Args:
        frame: Ordinal of the frame.
        camera: Name of the camera.
        truth_levels: `[H, W, 3]` ground truth in 8-bit levels.
        picture: `[H, W, 3]` rendering before clamping.
        mask: `[H, W]` mask of the pixels to use; None for all pixels.
    """
    truth = truth_levels.astype(np.float32) / np.float32(255)
    return make_view_with_truth(frame, camera, truth_levels, truth, picture, mask)


def make_view_with_truth(  # noqa: PLR0913, all are parts of the view
    frame: int,
    camera: str,
    truth_levels: Image,
    truth: Picture,
    picture: Picture,
    mask: Mask | None = None,
) -> View:
    """Measure a rendering against its ground truth; return a view with both and the metrics.

    Args:
        frame: Ordinal of the frame.
        camera: Name of the camera.
        truth_levels: `[H, W, 3]` ground truth in 8-bit levels.
        truth: `[H, W, 3]` ground truth from 0 to 1, not rounded to 8-bit levels.
        picture: `[H, W, 3]` rendering before clamping.
        mask: `[H, W]` mask of the pixels to use; None or an empty mask stands for all pixels.
    """
    decoded = np.clip(picture, 0, 1)
    if mask is None or not mask.any():
        mask = None
    else:
        decoded, truth = decoded * mask[..., None], truth * mask[..., None]
    psnr, ssim = measure_psnr(decoded, truth, mask), measure_ssim(decoded, truth, mask)
    return View(frame, camera, truth_levels, truth, decoded, psnr, ssim, mask)
