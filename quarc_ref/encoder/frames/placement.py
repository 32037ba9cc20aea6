"""Places new Gaussians: as clones of Gaussians in changed regions, or at pixels with large errors.

The placement `gate` is the paper's rule (section 5): it clones Gaussians that pass the change
gate. The placement `errors` (not in the paper) puts Gaussians on the surface that is visible at
pixels with a large error, and gives them the colors of these pixels. `errors` also handles color
changes without motion, which the gate barely detects.
"""

import math

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from quarc_ref.encoder.frames.change_gate import compute_gate_weights
from quarc_ref.encoder.settings.frames import BirthSettings
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.density import ScreenStatistics, sample_offsets
from quarc_ref.encoder.training.fixed_scene import FixedScene
from quarc_ref.encoder.training.trainable import Attributes, to_sh_dc
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.rasterizer import Gaussians

_MIN_ALPHA = 0.5


def place_clones(
    context: TrainingContext,
    scene: Attributes,
    frame: int,
    statistics: ScreenStatistics,
    settings: BirthSettings,
) -> tuple[Attributes, Tensor]:
    """Clone the Gaussians with the largest gated gradients.

    A gated gradient is a screen-space gradient multiplied by the weight of the change gate.

    Args:
        context: Views, renderer and random numbers.
        scene: Scene after the motion of the frame.
        frame: Ordinal of the frame.
        statistics: Screen-space gradients of stage 1.
        settings: Thresholds and maximum number of births.

    Returns:
        The clones, and the `[n]` indices of their parents.
    """
    weights = compute_gate_weights(context, scene, frame, settings.gate_views)
    gated_gradients = statistics.mean_gradients() * weights
    is_small = (
        torch.exp(scene.log_scales.amax(dim=1)) <= settings.max_parent_scale * context.views.extent
    )
    candidates = torch.nonzero(is_small & (gated_gradients >= settings.grad_threshold))[:, 0]
    strongest_indices = torch.argsort(gated_gradients[candidates], descending=True, stable=True)[
        : settings.max_births
    ]
    parents = candidates[strongest_indices]
    parent_gaussians = scene.rows(parents)
    generator = context.generator(frame, "births")
    births = Attributes(
        parent_gaussians.means + sample_offsets(parent_gaussians, settings.spread, generator),
        _make_identity_rotations(parents.numel(), parent_gaussians.means),
        parent_gaussians.log_scales,
        torch.full_like(parent_gaussians.opacities, settings.opacity_logit),
        parent_gaussians.sh_dc,
        parent_gaussians.sh_rest,
    )
    return births, parents


def place_at_errors(
    context: TrainingContext, scene: FixedScene, frame: int, settings: BirthSettings
) -> tuple[Attributes, Tensor]:
    """Place new Gaussians at the pixels with the largest errors.

    Args:
        context: Training views and renderer.
        scene: Scene after the motion of the frame.
        frame: Ordinal of the frame.
        settings: Error threshold and maximum number of births.

    Returns:
        The new Gaussians, and the `[n]` indices of their parents: the nearest Gaussians in the
        scene.
    """
    candidates_by_view = [
        _place_in_view(context, scene, view, frame, settings)
        for view in context.views.used_at(frame)
    ]
    errors, positions, colors, scales = (
        torch.cat(parts) for parts in zip(*candidates_by_view, strict=True)
    )
    strongest_indices = torch.argsort(errors, descending=True, stable=True)[: settings.max_births]
    positions, colors, scales = (
        positions[strongest_indices],
        colors[strongest_indices],
        scales[strongest_indices],
    )
    births = Attributes(
        positions,
        _make_identity_rotations(strongest_indices.numel(), positions),
        torch.log(scales)[:, None].repeat(1, 3),
        torch.full_like(scales, settings.opacity_logit),
        to_sh_dc(colors)[:, None],
        positions.new_zeros(strongest_indices.numel(), 3, 3),
    )
    return births, find_nearest(scene.attributes.means, positions)


def find_nearest(points: Tensor, queries: Tensor) -> Tensor:
    """Return the `[n]` indices of the points `[N, 3]` nearest to the queries `[n, 3]`."""
    if not queries.shape[0]:
        return torch.zeros(0, dtype=torch.int64, device=queries.device)
    _, nearest_indices = cKDTree(points.cpu().numpy()).query(queries.cpu().numpy())
    return torch.from_numpy(np.asarray(nearest_indices, dtype=np.int64)).to(queries.device)


def filter_maximum(image: Tensor, radius: int) -> Tensor:
    """Return the maximum of each pixel's square neighborhood, `2 * radius + 1` pixels wide.

    `max_pool2d` gives the same result but takes ten times as long on a CPU.

    Args:
        image: `[H, W]` nonnegative numbers.
        radius: Distance in pixels from the center pixel to the edge pixels of the square.
    """
    for axis, length in enumerate(image.shape):
        reach = min(radius, length - 1)  # the square may be wider than the image
        padding = (0, 0, reach, reach) if axis == 0 else (reach, reach, 0, 0)
        padded = torch.nn.functional.pad(image, padding)
        for offset in range(2 * reach + 1):
            image = torch.maximum(image, padded.narrow(axis, offset, length))
    return image


def _place_in_view(
    context: TrainingContext, scene: FixedScene, view: int, frame: int, settings: BirthSettings
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Return errors, positions, colors and scales of new Gaussians at the selected pixels.

    A pixel is selected if its error is a local maximum above the threshold, and the alpha of
    the rendering is large enough to measure a depth. Renderings are clamped to the white of the
    view, because a camera records nothing brighter.
    """
    camera, truth = context.camera(view), context.truth(view, frame)
    backdrop = scene.backdrop(view)
    image = torch.minimum(backdrop.image.clamp(min=0), context.exposures.white(view))
    image = context.apply_mask(image, view, frame)
    pixel_errors = (image - truth).abs().mean(dim=2)
    neighborhood_maxima = filter_maximum(pixel_errors, settings.error_radius)
    is_selected = (
        (pixel_errors == neighborhood_maxima)
        & (pixel_errors > settings.error_threshold)
        & (backdrop.alpha > _MIN_ALPHA)
    )
    rows, columns = torch.nonzero(is_selected, as_tuple=True)
    depths = (
        _measure_depths(context, scene, view)[rows, columns]
        if rows.numel()
        else pixel_errors[:0, 0]
    )
    positions = _unproject(camera, columns + 0.5, rows + 0.5, depths)
    scales = depths / math.sqrt(camera.fx * camera.fy) * (settings.error_radius + 0.5)
    return pixel_errors[rows, columns], positions, truth[rows, columns], scales


def _measure_depths(context: TrainingContext, scene: FixedScene, view: int) -> Tensor:
    """Return the `[H, W]` alpha-weighted mean depth of each pixel of a view, in world units."""
    camera, black = context.camera(view), scene.attributes.means.new_zeros(3)
    with torch.no_grad():
        rendering = context.rasterizer.render(
            _color_by_depth(scene.attributes, camera), camera, black
        )
    return rendering.image[..., 0] / rendering.alpha


def _color_by_depth(scene: Attributes, camera: Camera) -> Gaussians:
    """Return the Gaussians with red, green and blue replaced by their depth."""
    gaussians = scene.activated()
    optical_axis = scene.means.new_tensor(camera.rotation[6:])
    depths = scene.means @ optical_axis + camera.translation[2]
    sh = torch.zeros_like(gaussians.sh)
    sh[:, 0] = to_sh_dc(depths)[:, None]
    return Gaussians(
        gaussians.means, gaussians.quaternions, gaussians.scales, gaussians.opacities, sh
    )


def _unproject(camera: Camera, columns: Tensor, rows: Tensor, depths: Tensor) -> Tensor:
    """Return the `[n, 3]` world positions of pixels from their depths `[n]`."""
    x = (columns - camera.cx) / camera.fx * depths
    y = (rows - camera.cy) / camera.fy * depths
    rotation = depths.new_tensor(camera.rotation).reshape(3, 3)
    translation = depths.new_tensor(camera.translation)
    return (torch.stack([x, y, depths], dim=1) - translation) @ rotation


def _make_identity_rotations(count: int, like_tensor: Tensor) -> Tensor:
    return like_tensor.new_tensor([1.0, 0.0, 0.0, 0.0]).repeat(count, 1)
