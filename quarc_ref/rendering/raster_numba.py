"""The CPU backend: numba kernels as two differentiable steps, project and composite.

The first step passes `means2d` to the second step as a tensor of the autograd graph, so
the gradient of `means2d` is available.
"""

from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd import Function
from torch.autograd.function import once_differentiable

from quarc_ref.format.cameras import Camera
from quarc_ref.rendering import gradient_kernels, projection_gradient_kernels
from quarc_ref.rendering.layers import Layer, join_layer, render_layer
from quarc_ref.rendering.pipeline import (
    KERNEL_LOCK,
    bin_tiles,
    composite,
    flatten_camera,
    make_blank_picture,
    project,
)
from quarc_ref.rendering.pipeline_data import (
    Projection,
    SplatRows,
)
from quarc_ref.rendering.rasterizer import Backdrop, Gaussians, Rendering
from quarc_ref.rendering.tensor_arrays import to_array


class NumbaRasterizer:
    """Renders float32 Gaussians on the CPU."""

    name = "numba"

    def render(self, gaussians: Gaussians, camera: Camera, background: Tensor) -> Rendering:
        """See `Rasterizer.render`."""
        return _render(gaussians, camera, background, None)

    def render_backdrop(self, gaussians: Gaussians, camera: Camera, background: Tensor) -> Backdrop:
        """See `Rasterizer.render_backdrop`."""
        gaussian_rows = SplatRows(*(to_array(tensor) for tensor in gaussians.tensors()))
        return _LayeredBackdrop(
            camera, background, render_layer(camera, gaussian_rows, to_array(background))
        )


class _LayeredBackdrop:
    """Backdrop that renders only the tiles that added Gaussians intersect."""

    def __init__(self, camera: Camera, background: Tensor, layer: Layer) -> None:
        self._camera, self._background, self._layer = camera, background, layer
        self.image = torch.from_numpy(layer.picture.image)
        self.alpha = torch.from_numpy(1 - np.abs(layer.picture.transmittance))

    def render(self, added: Gaussians) -> Rendering:
        """See `Backdrop.render`."""
        return _render(added, self._camera, self._background, self._layer)


def _render(
    gaussians: Gaussians, camera: Camera, background: Tensor, layer: Layer | None
) -> Rendering:
    means2d, conics, colors, depths, max_exponents, radii = _Project.apply(
        camera, *gaussians.tensors()
    )
    image, alpha = _Composite.apply(
        camera,
        background,
        layer,
        (depths, max_exponents),
        means2d,
        conics,
        colors,
        gaussians.opacities,
    )
    return Rendering(image, alpha, means2d, radii)


class _Project(Function):
    """Projection as an autograd function; opacities affect only which Gaussians are visible."""

    @staticmethod
    def forward(
        ctx: Any,  # noqa: ANN401
        camera: Camera,
        *inputs: Tensor,
    ) -> tuple[Tensor, ...]:
        gaussian_rows = SplatRows(*(to_array(tensor) for tensor in inputs))
        projection = project(camera, gaussian_rows)
        ctx.camera, ctx.gaussian_rows, ctx.projection = camera, gaussian_rows, projection
        outputs = (
            projection.means2d,
            projection.conics,
            projection.colors,
            projection.depths,
            projection.max_exponents,
            projection.radii,
        )
        tensors = tuple(torch.from_numpy(array) for array in outputs)
        ctx.mark_non_differentiable(*tensors[3:])
        return tensors

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Any, ...]:  # noqa: ANN401
        gaussian_rows, projection = ctx.gaussian_rows, ctx.projection
        g_means2d, g_conics, g_colors = (to_array(gradient) for gradient in gradients[:3])
        inputs = (
            gaussian_rows.means,
            gaussian_rows.quaternions,
            gaussian_rows.scales,
            gaussian_rows.sh,
        )
        outputs = [np.empty_like(array) for array in inputs]
        with KERNEL_LOCK:
            projection_gradient_kernels.project_backward(
                flatten_camera(ctx.camera), *inputs, projection.max_exponents, projection.colors,
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
        layer: Layer | None,
        visibility: tuple[Tensor, Tensor],
        *inputs: Tensor,
    ) -> tuple[Tensor, Tensor]:
        means2d, conics, colors, opacities = (to_array(tensor) for tensor in inputs)
        depths, max_exponents = (to_array(tensor) for tensor in visibility)
        projection = Projection(
            means2d, conics, colors, opacities, depths, max_exponents, max_exponents
        )
        tiles, picture, fixed_count = bin_tiles(camera, projection), make_blank_picture(camera), 0
        if layer is not None:
            fixed_count = layer.projection.opacities.size
            projection, tiles = join_layer(layer, projection, tiles)
            np.copyto(picture.image, layer.picture.image)
            np.copyto(picture.transmittance, layer.picture.transmittance)
        composite(projection, tiles, to_array(background), picture)
        ctx.cache = (projection, tiles, fixed_count, picture)
        alpha = 1 - np.abs(picture.transmittance)
        return torch.from_numpy(picture.image), torch.from_numpy(alpha)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, g_image: Tensor, g_alpha: Tensor) -> tuple[Any, ...]:  # noqa: ANN401
        projection, tiles, fixed_count, picture = ctx.cache
        inputs = (
            projection.means2d,
            projection.conics,
            projection.colors,
            projection.opacities,
        )
        outputs = [np.empty_like(array[fixed_count:]) for array in inputs]
        with KERNEL_LOCK:
            pairs = gradient_kernels.raster_backward(
                *inputs, tiles.tile_ids, tiles.list_starts, tiles.lists, tiles.pixel_rows,
                fixed_count, picture.image, picture.transmittance,
                to_array(g_image), to_array(g_alpha),
            )  # fmt: skip
            gradient_kernels.sum_pair_gradients(
                pairs, tiles.pair_starts, tiles.pair_positions, *outputs
            )
        return None, None, None, None, *(torch.from_numpy(array) for array in outputs)
