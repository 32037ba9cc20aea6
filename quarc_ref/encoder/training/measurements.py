"""Measures scenes in all training views: error, loss and exposures.

Before frame 0 is coded, its error sets the translation step in the header. The reference loss of
later frames is the loss of decoded frame 0. Exposures and reference loss are computed from decoded
frames. They depend only on the stream and the pictures, so a resumed encode computes the same
values.

Together with exposures, the errors of edges are measured: they grow at once if a camera moves.
"""

import math
from collections.abc import Iterator, Sequence

import torch
from torch import Tensor

from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.trainable import Attributes, from_splats
from quarc_ref.rendering.rasterizer import Rendering

_EDGE_SHARE = 0.05  # of the pixels
_MIN_GRADIENT = 1e-3

_Edges = tuple[Tensor, Tensor]  # pixels of a rendering and of a picture, `[P, 3]`


def measure_error(
    context: TrainingContext, attributes: Attributes, *, fits_exposures: bool
) -> float:
    """Return the root-mean-square error of frame 0 over the training views, as a fraction of white.

    Masked pixels are not counted. If all pixels are masked, the error is 0.

    Args:
        context: Training views and renderer.
        attributes: Gaussians of frame 0.
        fits_exposures: Whether the exposures of the views are estimated from these Gaussians first.
    """
    if fits_exposures:
        context.exposures.estimate_all(_make_exposure_pairs(context, attributes, 0))
    squared_error = used_share = 0.0
    for view, (image, _) in enumerate(_render_attributes(context, attributes, 0)):
        mask = context.views.mask(view, 0)
        squared_error += float((image - context.truth(view, 0)).square().mean())
        used_share += 1.0 if mask is None else float(mask.mean())
    return math.sqrt(squared_error / used_share) if used_share else 0.0


def render_views(context: TrainingContext, state: FrameState) -> Iterator[tuple[Tensor, Tensor]]:
    """Yield, for each view, the rendering of the decoded scene and the picture, both `[H, W, 3]`.

    Masked pixels are black in both images.
    """
    attributes = from_splats(dequantize(state.scene), context.device)
    return _render_attributes(context, attributes, state.scene.frame)


def refit_exposures(context: TrainingContext, state: FrameState) -> None:
    """Estimate the exposures of the training views from the decoded scene of frame 0."""
    attributes = from_splats(dequantize(state.scene), context.device)
    context.exposures.estimate_all(_make_exposure_pairs(context, attributes, state.scene.frame))


def follow_exposures(context: TrainingContext, state: FrameState, frame: int) -> list[float]:
    """Estimate the exposures of a later frame; see `Exposures.follow`.

    Args:
        context: Training context whose exposures have been estimated for frame 0.
        state: Decoded state of the previous frame.
        frame: Ordinal of the frame.

    Returns:
        `[V]` error of the median pixel among those with the largest gradients in the rendering, as
        a fraction of white; NaN for views without pixels.
    """
    attributes = from_splats(dequantize(state.scene), context.device)
    edges: list[_Edges] = []
    context.exposures.follow(_make_exposure_pairs(context, attributes, frame, edges))
    return _measure_edge_errors(context, edges)


def measure_loss(context: TrainingContext, state: FrameState, lambda_dssim: float) -> float:
    """Return the mean photometric loss of a decoded scene over the training views.

    Args:
        context: Training context whose exposures are final.
        state: Decoded state of the frame.
        lambda_dssim: Weight of D-SSIM in the loss.
    """
    frame, used_views = state.scene.frame, context.views.used_at(state.scene.frame)
    losses = [
        float(context.photometric_loss(image, view, frame, lambda_dssim))
        for view, (image, _) in enumerate(render_views(context, state))
        if view in used_views
    ]
    return sum(losses) / len(losses)


def _render_attributes(
    context: TrainingContext, attributes: Attributes, frame: int
) -> Iterator[tuple[Tensor, Tensor]]:
    backgrounds = [context.background(view) for view in range(context.view_count)]
    for view, rendering in enumerate(_render(context, attributes, backgrounds)):
        image = context.apply_mask(rendering.image, view, frame)
        yield image, context.views.picture(view, frame)


def _make_exposure_pairs(
    context: TrainingContext, attributes: Attributes, frame: int, edges: list[_Edges] | None = None
) -> Iterator[tuple[Tensor, Tensor]]:
    """Yield the pixels from which exposures are estimated; append those of edges to `edges`.

    Views are rendered on black. The background of `TrainingContext.render` depends on the gains
    before this estimate, which a resumed encode does not know, and would affect the last bits.
    """
    black = torch.zeros(3, device=context.device)
    backgrounds = [black] * context.view_count
    for view, rendering in enumerate(_render(context, attributes, backgrounds)):
        if edges is not None:
            uncovered = 1 - rendering.alpha[..., None]
            image = rendering.image + uncovered * context.background(view)
            edges.append(_find_edges(context, image, view, frame))
        yield context.exposure_pair(rendering, black, view, frame)


def _find_edges(context: TrainingContext, image: Tensor, view: int, frame: int) -> _Edges:
    """Return the pixels of an image `[H, W, 3]`, and of the picture, where the image has edges."""
    gray = image.mean(dim=2)
    gradients = torch.zeros_like(gray)
    gradients[:, 1:] += gray.diff(dim=1).abs()
    gradients[1:] += gray.diff(dim=0).abs()
    mask = context.views.mask(view, frame)
    if mask is not None:
        gradients *= mask[..., 0]
    count = math.ceil(_EDGE_SHARE * gray.numel())
    strength = gradients.flatten().kthvalue(gray.numel() - count + 1).values
    is_edge = gradients >= strength.clamp(min=_MIN_GRADIENT)
    return image[is_edge], context.views.picture(view, frame)[is_edge]


def _measure_edge_errors(context: TrainingContext, edges: list[_Edges]) -> list[float]:
    gains = context.exposures.gains
    return [
        float((image - picture / gain).abs().mean(dim=1).median()) if len(image) else math.nan
        for (image, picture), gain in zip(edges, gains, strict=True)
    ]


def _render(
    context: TrainingContext, attributes: Attributes, backgrounds: Sequence[Tensor]
) -> Iterator[Rendering]:
    """Yield the rendering of each view on its background color."""
    gaussians = attributes.activated()
    for camera, background in zip(context.views.cameras, backgrounds, strict=True):
        with torch.no_grad():
            rendering = context.rasterizer.render(gaussians, camera, background)
        yield rendering
