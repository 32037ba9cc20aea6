"""The reference backend: plain torch in any float type, differentiated by autograd.

This backend is simple but slow. Tests compare the other backends with this backend in float64. All
pixels of a tile and all Gaussians whose bounding boxes intersect the tile form one matrix.
"""

import torch
from torch import Tensor

from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import LOW_PASS, NEAR_FRACTION, SH_C0, SH_C1
from quarc_ref.rendering.rasterizer import Backdrop, Gaussians, JoinedBackdrop, Rendering

_TILE = 16
_SLOPE_MARGIN_FRACTION = 0.15
_MIN_ALPHA = 1 / 255
_MIN_TRANSMITTANCE = 1e-4


class TorchRasterizer:
    """Renders Gaussians with plain torch operations."""

    name = "torch"

    def render(self, gaussians: Gaussians, camera: Camera, background: Tensor) -> Rendering:
        """See `Rasterizer.render`."""
        rotation = gaussians.means.new_tensor(camera.rotation).reshape(3, 3)
        points = gaussians.means @ rotation.T + gaussians.means.new_tensor(camera.translation)
        with torch.no_grad():
            is_drawn = torch.isfinite(points).all(dim=1) & (
                points[:, 2] > NEAR_FRACTION * camera.near
            )
            is_drawn &= gaussians.opacities > _MIN_ALPHA
        safe_points = torch.where(is_drawn[:, None], points, points.new_tensor([0.0, 0.0, 1.0]))
        means2d = _project_means(safe_points, camera)
        covariances = _project_covariances(gaussians, rotation, safe_points, camera)
        colors = _shade(gaussians, rotation, camera)
        projected_splats = (means2d, covariances, gaussians.opacities, colors)
        with torch.no_grad():
            is_drawn = is_drawn & _find_finite_rows(
                means2d, covariances, colors, torch.linalg.det(covariances)[:, None]
            )
            depths = safe_points[:, 2].to(torch.float32)
            order = torch.argsort(depths, stable=True)
            order = order[is_drawn[order]]
            low, high = _find_bounds(means2d, covariances, gaussians.opacities)
            size = means2d.new_tensor([camera.width, camera.height])
            is_visible = is_drawn & ((high >= 0) & (low <= size)).all(dim=1)
            radii = torch.where(is_visible, _compute_radii(covariances), 0)
        image, alpha = _composite(projected_splats, (low, high), order, camera, background)
        return Rendering(image, alpha, means2d, radii)

    def render_backdrop(self, gaussians: Gaussians, camera: Camera, background: Tensor) -> Backdrop:
        """See `Rasterizer.render_backdrop`."""
        return JoinedBackdrop(self, gaussians, camera, background)


def _find_finite_rows(*tensors: Tensor) -> Tensor:
    """Return `[N]` booleans: whether a row is finite in all tensors."""
    flat = torch.cat([tensor.flatten(start_dim=1) for tensor in tensors], dim=1)
    return torch.isfinite(flat).all(dim=1)


def _project_means(points: Tensor, camera: Camera) -> Tensor:
    u = camera.fx * points[:, 0] / points[:, 2] + camera.cx
    v = camera.fy * points[:, 1] / points[:, 2] + camera.cy
    return torch.stack([u, v], dim=1)


def _project_covariances(
    gaussians: Gaussians, rotation: Tensor, points: Tensor, camera: Camera
) -> Tensor:
    """Return the `[N, 2, 2]` projected covariances in pixels (EWA)."""
    axes = rotation @ _rotation_matrices(gaussians.quaternions) * gaussians.scales[:, None, :]
    x, y, z = points.unbind(dim=1)
    slope_x = _clamp_slope(x / z, camera.cx, camera.fx, camera.width)
    slope_y = _clamp_slope(y / z, camera.cy, camera.fy, camera.height)
    rows = [
        camera.fx / z[:, None] * (axes[:, 0] - slope_x[:, None] * axes[:, 2]),
        camera.fy / z[:, None] * (axes[:, 1] - slope_y[:, None] * axes[:, 2]),
    ]
    projected_axes = torch.stack(rows, dim=1)
    low_pass = LOW_PASS * torch.eye(2, dtype=z.dtype, device=z.device)
    return projected_axes @ projected_axes.transpose(1, 2) + low_pass


def _clamp_slope(slope: Tensor, center: float, focal: float, size: int) -> Tensor:
    low = -(center + _SLOPE_MARGIN_FRACTION * size) / focal
    return slope.clamp(low, (size - center + _SLOPE_MARGIN_FRACTION * size) / focal)


def _rotation_matrices(quaternions: Tensor) -> Tensor:
    w, x, y, z = torch.nn.functional.normalize(quaternions, dim=1).unbind(dim=1)
    rows = [
        torch.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], dim=1),
        torch.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], dim=1),
        torch.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], dim=1),
    ]
    return torch.stack(rows, dim=1)


def _shade(gaussians: Gaussians, rotation: Tensor, camera: Camera) -> Tensor:
    center = -rotation.T @ gaussians.means.new_tensor(camera.translation)
    direction = torch.nn.functional.normalize(gaussians.means - center, dim=1)
    x, y, z = direction.unbind(dim=1)
    basis = torch.stack([torch.full_like(x, SH_C0), -SH_C1 * y, SH_C1 * z, -SH_C1 * x], dim=1)
    basis = basis[:, : gaussians.sh.shape[1], None]
    return torch.clamp((basis * gaussians.sh).sum(dim=1) + 0.5, min=0)


def _compute_radii(covariances: Tensor) -> Tensor:
    mean_variance = (covariances[:, 0, 0] + covariances[:, 1, 1]) / 2
    discriminant = (mean_variance * mean_variance - torch.linalg.det(covariances)).clamp(min=0)
    return 3 * torch.sqrt(mean_variance + torch.sqrt(discriminant))


def _find_bounds(means2d: Tensor, covariances: Tensor, opacities: Tensor) -> tuple[Tensor, Tensor]:
    """Return the corners `[N, 2]` of the boxes outside of which alpha is below 1/255."""
    doubled_exponents = 2 * torch.log(opacities.clamp(min=_MIN_ALPHA) / _MIN_ALPHA)
    extent = torch.sqrt(doubled_exponents[:, None] * torch.diagonal(covariances, dim1=1, dim2=2))
    return means2d - extent, means2d + extent


def _composite(
    projected_splats: tuple[Tensor, ...],
    bounds: tuple[Tensor, Tensor],
    order: Tensor,
    camera: Camera,
    background: Tensor,
) -> tuple[Tensor, Tensor]:
    low, high = bounds
    strips = []
    for top in range(0, camera.height, _TILE):
        bottom = min(top + _TILE, camera.height)
        row_order = order[(high[order, 1] >= top) & (low[order, 1] <= bottom)]
        tiles = []
        for left in range(0, camera.width, _TILE):
            right = min(left + _TILE, camera.width)
            tile_order = row_order[(high[row_order, 0] >= left) & (low[row_order, 0] <= right)]
            box = (left, right, top, bottom)
            tiles.append(
                _composite_tile([part[tile_order] for part in projected_splats], box, background)
            )
        strips.append(torch.cat(tiles, dim=1))
    picture = torch.cat(strips, dim=0)
    return picture[..., :3], picture[..., 3]


def _composite_tile(
    projected_splats: list[Tensor], box: tuple[int, int, int, int], background: Tensor
) -> Tensor:
    """Return `[h, w, 4]` color and alpha of a tile; Gaussians must be sorted by depth."""
    means2d, covariances, opacities, colors = projected_splats
    left, right, top, bottom = box
    y = torch.arange(top, bottom, dtype=means2d.dtype, device=means2d.device) + 0.5
    x = torch.arange(left, right, dtype=means2d.dtype, device=means2d.device) + 0.5
    pixels = torch.stack(torch.meshgrid(x, y, indexing="xy"), dim=-1).reshape(-1, 1, 2)
    offsets = (pixels - means2d)[..., None]
    exponents = (offsets.mT @ torch.linalg.inv(covariances) @ offsets)[..., 0, 0] / 2
    alphas = (opacities * torch.exp(-exponents)).clamp(max=0.99)
    alphas = torch.where((alphas >= _MIN_ALPHA) & (exponents >= 0), alphas, 0)
    transmittance_after = torch.cumprod(1 - alphas, dim=1)
    alphas = torch.where(transmittance_after > _MIN_TRANSMITTANCE, alphas, 0)
    ones = alphas.new_ones(alphas.shape[0], 1)
    transmittance_before = torch.cumprod(torch.cat([ones, 1 - alphas], dim=1), dim=1)
    weights = alphas * transmittance_before[:, :-1]
    color = weights @ colors + transmittance_before[:, -1:] * background
    picture = torch.cat([color, 1 - transmittance_before[:, -1:]], dim=1)
    return picture.reshape(bottom - top, right - left, 4)
