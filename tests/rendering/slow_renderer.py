"""Renders every pixel separately in Python floats, as described in SPEC 10."""

import math
from typing import NamedTuple


class _Splat(NamedTuple):
    depth: float
    place: tuple[float, float]
    covariance: tuple[float, float, float]
    opacity: float
    color: list[float]


def draw_slowly(gaussians, camera, background) -> list[list[list[float]]]:
    """The picture `[H][W][3]` of activated Gaussians (tensors with a row for each)."""
    splats = [_project(gaussians, camera, i) for i in range(gaussians.means.shape[0])]
    near = 0.8 * camera.near
    ordered = sorted((s for s in splats if s.depth > near), key=lambda splat: splat.depth)
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
        _hold(x / z, camera.cx, camera.fx, camera.width),
        _hold(y / z, camera.cy, camera.fy, camera.height),
    )
    jacobian = (
        (camera.fx / z, 0.0, -camera.fx / z * slopes[0]),
        (0.0, camera.fy / z, -camera.fy / z * slopes[1]),
    )
    axes = _turn_matrix(gaussians.quaternions[i].tolist())
    columns = [[_dot(row, column) for row in rotation] for column in zip(*axes, strict=True)]
    u, v = (
        [_dot(row, column) * size for column, size in zip(columns, scale, strict=True)]
        for row in jacobian
    )
    covariance = (_dot(u, u) + 0.3, _dot(u, v), _dot(v, v) + 0.3)
    place = (camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy)
    center = [-_dot(column, camera.translation) for column in zip(*rotation, strict=True)]
    direction = [m - c for m, c in zip(mean, center, strict=True)]
    color = _shade(gaussians.sh[i].tolist(), direction)
    return _Splat(z, place, covariance, float(gaussians.opacities[i]), color)


def _composite(splats, x, y, background) -> list[float]:
    left, pixel = 1.0, [0.0, 0.0, 0.0]
    for splat in splats:
        xx, xy, yy = splat.covariance
        du, dv = x - splat.place[0], y - splat.place[1]
        squared = yy * du * du - 2 * xy * du * dv + xx * dv * dv
        alpha = min(0.99, splat.opacity * math.exp(-squared / (2 * (xx * yy - xy * xy))))
        if alpha < 1 / 255:
            continue
        if left * (1 - alpha) <= 1e-4:
            break
        pixel = [p + alpha * left * c for p, c in zip(pixel, splat.color, strict=True)]
        left *= 1 - alpha
    return [p + left * b for p, b in zip(pixel, background, strict=True)]


def _shade(sh, direction) -> list[float]:
    length = math.sqrt(_dot(direction, direction))
    x, y, z = (d / length for d in direction)
    basis = (0.28209479177387814, *(0.4886025119029199 * b for b in (-y, z, -x)))
    return [max(0.0, 0.5 + _dot(basis, [row[k] for row in sh])) for k in range(3)]


def _turn_matrix(quaternion) -> list[list[float]]:
    norm = math.sqrt(_dot(quaternion, quaternion))
    w, x, y, z = (q / norm for q in quaternion)
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def _hold(slope, middle, focal, size) -> float:
    return min(max(slope, -(middle + 0.15 * size) / focal), (1.15 * size - middle) / focal)


def _dot(a, b) -> float:
    return sum(p * q for p, q in zip(a, b, strict=True))
