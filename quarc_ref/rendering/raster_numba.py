"""The CPU backend: numba kernels as two differentiable steps, project and composite.

`means2d`, which is passed between them, is a tensor of the graph, so that its gradient is
available.
"""

from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd import Function
from torch.autograd.function import once_differentiable

from quarc_ref.format.cameras import Camera
from quarc_ref.rendering import gradient_kernels, projection_kernels
from quarc_ref.rendering.layers import Layer, draw_layer, join_layer
from quarc_ref.rendering.pipeline import (
    KERNEL_LOCK,
    bin_tiles,
    blank_picture,
    composite,
    flatten_camera,
    project,
)
from quarc_ref.rendering.pipeline_data import (
    Float32,
    Projection,
    SplatRows,
)
from quarc_ref.rendering.rasterizer import Backdrop, Gaussians, Rendering


class NumbaRasterizer:
    """Renders float32 Gaussians on the CPU."""

    name = "numba"

    def render(self, gaussians: Gaussians, camera: Camera, background: Tensor) -> Rendering:
        """See `Rasterizer.render`."""
        return _render(gaussians, camera, background, None)

    def render_backdrop(self, gaussians: Gaussians, camera: Camera, background: Tensor) -> Backdrop:
        """See `Rasterizer.render_backdrop`."""
        drawn = SplatRows(*(_array(tensor) for tensor in gaussians.tensors()))
        return _LayeredBackdrop(camera, background, draw_layer(camera, drawn, _array(background)))


class _LayeredBackdrop:
    """Renders only the tiles that the added Gaussians intersect."""

    def __init__(self, camera: Camera, background: Tensor, layer: Layer) -> None:
        self._camera, self._background, self._layer = camera, background, layer
        self.image = torch.from_numpy(layer.picture.image)
        self.alpha = torch.from_numpy(1 - np.abs(layer.picture.transmittance))

    def render(self, added: Gaussians) -> Rendering:
        """See `Backdrop.render`."""
        return _render(added, self._camera, self._background, self._layer)


def _render(
    gaussians: Gaussians, camera: Camera, background: Tensor, under: Layer | None
) -> Rendering:
    means2d, conics, colors, depths, reaches, radii = _Project.apply(camera, *gaussians.tensors())
    image, alpha = _Composite.apply(
        camera, background, under, (depths, reaches), means2d, conics, colors, gaussians.opacities
    )
    return Rendering(image, alpha, means2d, radii)


class _Project(Function):
    """Projection as an autograd function; opacities only determine visibility."""

    @staticmethod
    def forward(
        ctx: Any,  # noqa: ANN401
        camera: Camera,
        *inputs: Tensor,
    ) -> tuple[Tensor, ...]:
        drawn = SplatRows(*(_array(tensor) for tensor in inputs))
        projection = project(camera, drawn)
        ctx.camera, ctx.drawn, ctx.projection = camera, drawn, projection
        outputs = (
            projection.means2d,
            projection.conics,
            projection.colors,
            projection.depths,
            projection.reaches,
            projection.radii,
        )
        tensors = tuple(torch.from_numpy(array) for array in outputs)
        ctx.mark_non_differentiable(*tensors[3:])
        return tensors

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Any, ...]:  # noqa: ANN401
        drawn, projection = ctx.drawn, ctx.projection
        g_means2d, g_conics, g_colors = (_array(gradient) for gradient in gradients[:3])
        inputs = (drawn.means, drawn.quaternions, drawn.scales, drawn.sh)
        outputs = [np.empty_like(array) for array in inputs]
        with KERNEL_LOCK:
            projection_kernels.project_backward(
                flatten_camera(ctx.camera), *inputs, projection.reaches, projection.colors,
                g_means2d, g_conics, g_colors, *outputs,
            )  # fmt: skip
        g_means, g_quaternions, g_scales, g_sh = (torch.from_numpy(array) for array in outputs)
        return None, g_means, g_quaternions, g_scales, None, g_sh


class _Composite(Function):
    """Compositing as an autograd function."""

    @staticmethod
    def forward(
        ctx: Any,  # noqa: ANN401
        camera: Camera,
        background: Tensor,
        under: Layer | None,
        order: tuple[Tensor, Tensor],
        *inputs: Tensor,
    ) -> tuple[Tensor, Tensor]:
        means2d, conics, colors, opacities = (_array(tensor) for tensor in inputs)
        depths, reaches = (_array(tensor) for tensor in order)
        projection = Projection(means2d, conics, colors, opacities, depths, reaches, reaches)
        tiles, picture, fixed = bin_tiles(camera, projection), blank_picture(camera), 0
        if under is not None:
            fixed = under.projection.opacities.size
            projection, tiles = join_layer(under, projection, tiles)
            np.copyto(picture.image, under.picture.image)
            np.copyto(picture.transmittance, under.picture.transmittance)
        composite(projection, tiles, _array(background), picture)
        ctx.cache = (projection, tiles, fixed, picture)
        alpha = 1 - np.abs(picture.transmittance)
        return torch.from_numpy(picture.image), torch.from_numpy(alpha)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, g_image: Tensor, g_alpha: Tensor) -> tuple[Any, ...]:  # noqa: ANN401
        projection, tiles, fixed, picture = ctx.cache
        planes = (
            projection.means2d,
            projection.conics,
            projection.colors,
            projection.opacities,
        )
        outputs = [np.empty_like(array[fixed:]) for array in planes]
        with KERNEL_LOCK:
            pairs = gradient_kernels.raster_backward(
                *planes, tiles.which, tiles.borders, tiles.lists, tiles.rows, fixed,
                picture.image, picture.transmittance, _array(g_image), _array(g_alpha),
            )  # fmt: skip
            gradient_kernels.gather_pairs(pairs, tiles.starts, tiles.places, *outputs)
        return None, None, None, None, *(torch.from_numpy(array) for array in outputs)


def _array(tensor: Tensor) -> Float32:
    array: Float32 = tensor.detach().contiguous().numpy()
    return array
