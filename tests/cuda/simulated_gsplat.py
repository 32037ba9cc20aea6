"""A stand-in for gsplat's `rasterization`, which renders with the reference rasterizer."""

from typing import Any

import pytest
import torch
from torch import Tensor

from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import NEAR_FRACTION
from quarc_ref.rendering import raster_torch
from quarc_ref.rendering.rasterizer import Gaussians


def rasterization(
    means: Tensor,
    quats: Tensor,
    scales: Tensor,
    opacities: Tensor,
    colors: Tensor,
    viewmats: Tensor,
    Ks: Tensor,  # noqa: N803
    width: int,
    height: int,
    *,
    near_plane: float,
    eps2d: float,
    sh_degree: int,
    packed: bool,
    backgrounds: Tensor,
    rasterize_mode: str,
) -> tuple[Tensor, Tensor, dict[str, Any]]:
    """Render one camera; names and shapes of parameters and results are those of gsplat 1.5."""
    count = means.shape[0]
    shapes = [(3,), (4,), (3,), (), ((sh_degree + 1) ** 2, 3)]
    for tensor, shape in zip((means, quats, scales, opacities, colors), shapes, strict=True):
        assert tensor.shape == (count, *shape)
    for tensor in (means, quats, scales, opacities, colors, viewmats, Ks, backgrounds):
        assert tensor.device.type == "cuda"
        assert tensor.dtype == torch.float32
    assert (viewmats.shape, Ks.shape, backgrounds.shape) == ((1, 4, 4), (1, 3, 3), (1, 3))
    assert (eps2d, packed, rasterize_mode) == (0.3, False, "classic")
    matrix, intrinsics = viewmats[0].tolist(), Ks[0].tolist()
    camera = Camera(
        "simulated", width, height, intrinsics[0][0], intrinsics[1][1], intrinsics[0][2],
        intrinsics[1][2], tuple(matrix[row][column] for row in range(3) for column in range(3)),
        tuple(matrix[row][3] for row in range(3)), near_plane / NEAR_FRACTION, False,
    )  # fmt: skip
    batches = []
    project = raster_torch._project_means

    def project_batch(points: Tensor, camera: Camera) -> Tensor:
        """Add a camera axis to centers, because those of gsplat, and their gradients, have it."""
        batches.append(project(points, camera)[None])
        return batches[0][0]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(raster_torch, "_TILE", max(width, height))  # fewer operations
        patch.setattr(raster_torch, "_project_means", project_batch)
        gaussians = Gaussians(means, quats, scales, opacities, colors)
        rendering = raster_torch.TorchRasterizer().render(gaussians, camera, backgrounds[0])
    radii = rendering.radii.ceil().to(torch.int32)[None, :, None].expand(1, count, 2)
    metadata = {"means2d": batches[0], "radii": radii}
    return rendering.image[None], rendering.alpha[None, ..., None], metadata
