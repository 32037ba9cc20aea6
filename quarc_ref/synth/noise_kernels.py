"""Kernels for smooth noise and for the soft edges of patterns.

Noise interpolates hashed values at grid points, so no detail is finer than a grid cell.
"""

# mypy: allow-untyped-defs

import math

from quarc_ref.synth.compiled import kernel


@kernel
def hash_uniform(i, j, k):
    """Return a number from 0 to 1 that is a hash of three integers."""
    bits = (i * 374761393 + j * 668265263 + k * 1440662683) & 0xFFFFFFFF
    bits = ((bits ^ (bits >> 13)) * 1274126177) & 0xFFFFFFFF
    return ((bits ^ (bits >> 16)) & 0xFFFF) / 65535.0


@kernel
def ramp(x, low, high):
    """Return 0 below `low`, 1 above `high`, and a smooth transition between `low` and `high`."""
    x = min(max((x - low) / (high - low), 0.0), 1.0)
    return x * x * (3 - 2 * x)


@kernel
def blend(a, b, share):
    """Interpolate between two colors; `share` is the weight of the second color."""
    return (
        a[0] + share * (b[0] - a[0]),
        a[1] + share * (b[1] - a[1]),
        a[2] + share * (b[2] - a[2]),
    )


@kernel
def shade(color, factor):
    """Multiply a color by a factor."""
    return color[0] * factor, color[1] * factor, color[2] * factor


@kernel
def noise(x, y, z):
    """Return smooth noise from 0 to 1 with cells of size 1."""
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    u, v, w = ramp(x - i, 0.0, 1.0), ramp(y - j, 0.0, 1.0), ramp(z - k, 0.0, 1.0)
    i, j, k = int(i), int(j), int(k)
    lower_plane_value = _interpolate_plane(i, j, k, u, v)
    return lower_plane_value + w * (_interpolate_plane(i, j, k + 1, u, v) - lower_plane_value)


@kernel
def _interpolate_plane(i, j, k, u, v):
    low_value = hash_uniform(i, j, k) * (1 - u) + hash_uniform(i + 1, j, k) * u
    high_value = hash_uniform(i, j + 1, k) * (1 - u) + hash_uniform(i + 1, j + 1, k) * u
    return low_value + v * (high_value - low_value)
