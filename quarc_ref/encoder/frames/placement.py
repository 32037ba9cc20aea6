"""Places new Gaussians: clones that pass the change gate, or at pixels with errors.

`gate` is the paper's rule (section 5). `errors` (not in the paper) puts a Gaussian with
the true color on the surface at pixels with a large error, because the gate hardly
detects changes of color, which do not move Gaussians.
"""

import math

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from quarc_ref.encoder.frames.change_gate import measure_change
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

    Args:
        context: Views, renderer and random numbers.
        scene: Scene after the motion of the frame.
        frame: Ordinal of the frame.
        statistics: Screen-space gradients of stage 1.
        settings: Thresholds and bound.

    Returns:
        The clones, and the `[n]` indices of their parents.
    """
    weights = measure_change(context, scene, frame, settings.gate_views)
    gated = statistics.mean_gradients() * weights
    small = (
        torch.exp(scene.log_scales.amax(dim=1)) <= settings.max_parent_scale * context.views.extent
    )
    chosen = torch.nonzero(small & (gated >= settings.grad_threshold))[:, 0]
    best = torch.argsort(gated[chosen], descending=True, stable=True)[: settings.max_births]
    parents = chosen[best]
    clones = scene.rows(parents)
    generator = context.generator(frame, "births")
    births = Attributes(
        clones.means + sample_offsets(clones, settings.spread, generator),
        _identities(parents.numel(), clones.means),
        clones.log_scales,
        torch.full_like(clones.opacities, settings.opacity_logit),
        clones.sh_dc,
        clones.sh_rest,
    )
    return births, parents


def place_on_errors(
    context: TrainingContext, scene: FixedScene, frame: int, settings: BirthSettings
) -> tuple[Attributes, Tensor]:
    """Place Gaussians at the pixels with the largest errors.

    Args:
        context: Views and renderer.
        scene: Scene after the motion of the frame.
        frame: Ordinal of the frame.
        settings: Threshold and bound.

    Returns:
        The new Gaussians, and the `[n]` indices of the Gaussians nearest to them.
    """
    found = [
        _find_errors(context, scene, view, frame, settings)
        for view in range(len(context.views.cameras))
    ]
    errors, places, colors, sizes = (torch.cat(parts) for parts in zip(*found, strict=True))
    best = torch.argsort(errors, descending=True, stable=True)[: settings.max_births]
    places, colors, sizes = places[best], colors[best], sizes[best]
    births = Attributes(
        places,
        _identities(best.numel(), places),
        torch.log(sizes)[:, None].repeat(1, 3),
        torch.full_like(sizes, settings.opacity_logit),
        to_sh_dc(colors)[:, None],
        places.new_zeros(best.numel(), 3, 3),
    )
    return births, find_nearest(scene.attributes.means, places)


def find_nearest(scene: Tensor, places: Tensor) -> Tensor:
    """Return `[n]` indices of the rows of `scene` `[N, 3]` nearest to `places` `[n, 3]`."""
    if not places.shape[0]:
        return torch.zeros(0, dtype=torch.int64, device=places.device)
    _, nearest = cKDTree(scene.cpu().numpy()).query(places.cpu().numpy())
    return torch.from_numpy(np.asarray(nearest, dtype=np.int64)).to(places.device)


def find_largest_around(numbers: Tensor, reach: int) -> Tensor:
    """Apply a maximum filter over squares of `2 reach + 1` pixels.

    Equivalent to `max_pool2d`, but ten times as fast on a CPU.

    Args:
        numbers: `[H, W]` nonnegative numbers.
        reach: Half size of the squares.
    """
    for axis in (0, 1):
        margins = (0, 0, reach, reach) if axis == 0 else (reach, reach, 0, 0)
        padded = torch.nn.functional.pad(numbers, margins)
        for place in range(2 * reach + 1):
            numbers = torch.maximum(numbers, padded.narrow(axis, place, numbers.shape[axis]))
    return numbers


def _find_errors(
    context: TrainingContext, scene: FixedScene, view: int, frame: int, settings: BirthSettings
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Return error, position, true color and pixel size at the worst pixels of a view.

    A pixel is selected if its error is a local maximum above the threshold, and the scene
    covers it, so that its depth is known.
    """
    camera, truth = context.camera(view), context.truth(view, frame)
    seen = scene.backdrop(view)
    shown = context.mask(seen.image.clamp(0, 1), view, frame)
    error = (shown - truth).abs().mean(dim=2)
    peaks = find_largest_around(error, settings.error_radius)
    worst = (error == peaks) & (error > settings.error_threshold) & (seen.alpha > _MIN_ALPHA)
    rows, columns = torch.nonzero(worst, as_tuple=True)
    depths = _measure_depths(context, scene, view)[rows, columns] if rows.numel() else error[:0, 0]
    places = _unproject(camera, columns + 0.5, rows + 0.5, depths)
    sizes = depths / math.sqrt(camera.fx * camera.fy) * (settings.error_radius + 0.5)
    return error[rows, columns], places, truth[rows, columns], sizes


def _measure_depths(context: TrainingContext, scene: FixedScene, view: int) -> Tensor:
    """Return the `[H, W]` mean depths of a view."""
    with torch.no_grad():
        painted = context.render(_paint_depths(scene.attributes, context.camera(view)), view)
    return painted.image[..., 0] / painted.alpha


def _paint_depths(scene: Attributes, camera: Camera) -> Gaussians:
    """Return the Gaussians colored by their depth."""
    drawn = scene.activated()
    forward = scene.means.new_tensor(camera.rotation[6:])
    depths = scene.means @ forward + camera.translation[2]
    painted = torch.zeros_like(drawn.sh)
    painted[:, 0] = to_sh_dc(depths)[:, None]
    return Gaussians(drawn.means, drawn.quaternions, drawn.scales, drawn.opacities, painted)


def _unproject(camera: Camera, columns: Tensor, rows: Tensor, depths: Tensor) -> Tensor:
    """Return the `[n, 3]` world positions of pixels at given depths."""
    x = (columns - camera.cx) / camera.fx * depths
    y = (rows - camera.cy) / camera.fy * depths
    rotation = depths.new_tensor(camera.rotation).reshape(3, 3)
    translation = depths.new_tensor(camera.translation)
    return (torch.stack([x, y, depths], dim=1) - translation) @ rotation


def _identities(count: int, like: Tensor) -> Tensor:
    return like.new_tensor([1.0, 0.0, 0.0, 0.0]).repeat(count, 1)
