"""A slow renderer that computes every pixel separately in Python floats, following SPEC 10."""

import math
from typing import NamedTuple


class _Splat(NamedTuple):
    depth: float
    position: tuple[float, float]
    covariance: tuple[float, float, float]
    opacity: float
    color: list[float]


def render_slowly(gaussians, camera, background) -> list[list[list[float]]]:
    """Return the picture `[H][W][3]` of activated Gaussians, given as tensors of rows."""
    splats = [_project(gaussians, camera, i) for i in range(gaussians.means.shape[0])]
    near = 0.8 * camera.near
    ordered = sorted(
        (candidate for candidate in splats if candidate.depth > near), key=lambda splat: splat.depth
    )
    return [
        [_composite(ordered, column + 0.5, row + 0.5, background) for column in range(camera.width)]
        for row in range(camera.height)
    ]


def _project(gaussians, camera, i) -> _Splat:
    rotation = [camera.rotation[3 * row : 3 * row + 3] for row in range(3)]
    mean, scale = gaussians.means[i].tolist(), gaussians.scales[i].tolist()
    x, y, z = (
        _dot(row, mean) + shift for row, shift in zip(rotation, camera.translation, strict=True)
    )
    slopes = (
        _clamp_slope(x / z, camera.cx, camera.fx, camera.width),
        _clamp_slope(y / z, camera.cy, camera.fy, camera.height),
    )
    jacobian = (
        (camera.fx / z, 0.0, -camera.fx / z * slopes[0]),
        (0.0, camera.fy / z, -camera.fy / z * slopes[1]),
    )
    axes = _rotation_matrix(gaussians.quaternions[i].tolist())
    columns = [[_dot(row, column) for row in rotation] for column in zip(*axes, strict=True)]
    u, v = (
        [_dot(row, column) * size for column, size in zip(columns, scale, strict=True)]
        for row in jacobian
    )
    covariance = (_dot(u, u) + 0.3, _dot(u, v), _dot(v, v) + 0.3)
    position = (camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy)
    center = [-_dot(column, camera.translation) for column in zip(*rotation, strict=True)]
    direction = [
        mean_coordinate - center_coordinate
        for mean_coordinate, center_coordinate in zip(mean, center, strict=True)
    ]
    color = _shade(gaussians.sh[i].tolist(), direction)
    return _Splat(z, position, covariance, float(gaussians.opacities[i]), color)


def _composite(splats, x, y, background) -> list[float]:
    transmittance, pixel = 1.0, [0.0, 0.0, 0.0]
    for splat in splats:
        xx, xy, yy = splat.covariance
        du, dv = x - splat.position[0], y - splat.position[1]
        squared = yy * du * du - 2 * xy * du * dv + xx * dv * dv
        alpha = min(0.99, splat.opacity * math.exp(-squared / (2 * (xx * yy - xy * xy))))
        if alpha < 1 / 255:
            continue
        if transmittance * (1 - alpha) <= 1e-4:
            break
        pixel = [
            value + alpha * transmittance * channel
            for value, channel in zip(pixel, splat.color, strict=True)
        ]
        transmittance *= 1 - alpha
    return [
        value + transmittance * background_channel
        for value, background_channel in zip(pixel, background, strict=True)
    ]


def _shade(sh, direction) -> list[float]:
    length = math.sqrt(_dot(direction, direction))
    x, y, z = (d / length for d in direction)
    basis = (0.28209479177387814, *(0.4886025119029199 * b for b in (-y, z, -x)))
    return [max(0.0, 0.5 + _dot(basis, [row[k] for row in sh])) for k in range(3)]


def _rotation_matrix(quaternion) -> list[list[float]]:
    norm = math.sqrt(_dot(quaternion, quaternion))
    w, x, y, z = (q / norm for q in quaternion)
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def _clamp_slope(slope, center, focal, size) -> float:
    return min(max(slope, -(center + 0.15 * size) / focal), (1.15 * size - center) / focal)


def _dot(a, b) -> float:
    return sum(p * q for p, q in zip(a, b, strict=True))
