"""Kernels that intersect rays with solids, and compute normals.

Every solid is one of five shapes of about unit size, mapped to the world by an affine
matrix; the caller maps the ray to the space of the shape. Directions are not normalized,
so distances along the mapped ray equal those along the original ray. Rays that start
inside a solid do not intersect it, except for the blob.
"""

# mypy: allow-untyped-defs

import math

from quarc_ref.synth.compiled import inlined

BALL = 0
BOX = 1
CYLINDER = 2
CAPSULE = 3
BLOB = 4

MISS = 1e30
BLOB_SWELL = 0.16
_BLOB_WAVES = 0.43
_BLOB_STEP = 0.62  # relative to the distance, because waves make the surface steeper
_BLOB_STEPS = 48
_BLOB_NEAR = 1e-3
_SLOPE_STEP = 1e-3
_FLAT = 1e-12


@inlined
def entry(shape, bend, ox, oy, oz, dx, dy, dz):
    """Return the distance at which a ray enters a shape, or `MISS`.

    Args:
        shape: One of the five shapes above.
        bend: Half the length of a capsule's axis, or the phase of a blob's waves, turns.
        ox, oy, oz: Origin of the ray in the shape's space.
        dx, dy, dz: Direction of the ray in the shape's space.
    """
    if shape == BALL:
        return _enter_ball(ox, oy, oz, dx, dy, dz)
    if shape == BOX:
        return _enter_box(ox, oy, oz, dx, dy, dz)
    if shape == CYLINDER:
        return _enter_cylinder(ox, oy, oz, dx, dy, dz)
    if shape == CAPSULE:
        return _enter_capsule(bend, ox, oy, oz, dx, dy, dz)
    return _enter_blob(bend, ox, oy, oz, dx, dy, dz)


@inlined
def outward(shape, bend, x, y, z):
    """Return the outward normal, of any length, at a point of a shape's surface."""
    if shape == BOX:
        return _out_of_box(x, y, z)
    if shape == CYLINDER:
        if abs(y) > math.sqrt(x * x + z * z):
            return 0.0, y, 0.0
        return x, 0.0, z
    if shape == CAPSULE:
        return x, y - min(max(y, -bend), bend), z
    if shape == BLOB:
        return _out_of_blob(bend, x, y, z)
    return x, y, z


@inlined
def _enter_ball(ox, oy, oz, dx, dy, dz):
    a = dx * dx + dy * dy + dz * dz
    b = ox * dx + oy * dy + oz * dz
    c = ox * ox + oy * oy + oz * oz - 1
    root = b * b - a * c
    if root < 0 or b >= 0 or c < 0:
        return MISS
    return (-b - math.sqrt(root)) / a


@inlined
def _slab(o, d):
    """Return the interval of a ray in which one coordinate is between -1 and 1."""
    if abs(d) < _FLAT:
        d = _FLAT
    first, last = (-1 - o) / d, (1 - o) / d
    return min(first, last), max(first, last)


@inlined
def _enter_box(ox, oy, oz, dx, dy, dz):
    x0, x1 = _slab(ox, dx)
    y0, y1 = _slab(oy, dy)
    z0, z1 = _slab(oz, dz)
    first, last = max(x0, y0, z0), min(x1, y1, z1)
    return first if 0 < first <= last else MISS


@inlined
def _out_of_box(x, y, z):
    if abs(x) >= abs(y) and abs(x) >= abs(z):
        return x, 0.0, 0.0
    if abs(y) >= abs(z):
        return 0.0, y, 0.0
    return 0.0, 0.0, z


@inlined
def _enter_cylinder(ox, oy, oz, dx, dy, dz):
    a = max(dx * dx + dz * dz, _FLAT)
    b = ox * dx + oz * dz
    root = b * b - a * (ox * ox + oz * oz - 1)
    if root < 0:
        return MISS
    root = math.sqrt(root)
    low, high = _slab(oy, dy)
    first, last = max((-b - root) / a, low), min((-b + root) / a, high)
    return first if 0 < first <= last else MISS


@inlined
def _enter_capsule(half, ox, oy, oz, dx, dy, dz):
    a = max(dx * dx + dz * dz, _FLAT)
    b = ox * dx + oz * dz
    root = b * b - a * (ox * ox + oz * oz - 1)
    if root < 0:
        return MISS
    first = (-b - math.sqrt(root)) / a
    y = oy + first * dy
    if abs(y) <= half:
        return first if first > 0 else MISS
    return _enter_ball(ox, oy - math.copysign(half, y), oz, dx, dy, dz)


@inlined
def _swing(x):
    """Return an inexpensive approximation of the sine of x turns."""
    x -= math.floor(x + 0.5)
    return 8 * x * (1 - 2 * abs(x))


@inlined
def _blob_height(phase, x, y, z):
    waves = _swing(_BLOB_WAVES * x + phase) * _swing(_BLOB_WAVES * y + 0.11 - 2 * phase)
    waves += _swing(_BLOB_WAVES * z + 0.21 + phase) * _swing(_BLOB_WAVES * y + phase)
    return math.sqrt(x * x + y * y + z * z) - 1 + BLOB_SWELL * waves


@inlined
def _enter_blob(phase, ox, oy, oz, dx, dy, dz):
    a = dx * dx + dy * dy + dz * dz
    b = ox * dx + oy * dy + oz * dz
    c = ox * ox + oy * oy + oz * oz - (1 + 2 * BLOB_SWELL) ** 2
    root = b * b - a * c
    if root < 0:
        return MISS
    root = math.sqrt(root)
    t, last = max(0.0, (-b - root) / a), (-b + root) / a
    for _ in range(_BLOB_STEPS):
        if t > last:
            break
        height = _blob_height(phase, ox + t * dx, oy + t * dy, oz + t * dz)
        if height < _BLOB_NEAR:
            return t
        t += max(height * _BLOB_STEP, _BLOB_NEAR) / math.sqrt(a)
    return MISS


@inlined
def _out_of_blob(phase, x, y, z):
    e = _SLOPE_STEP
    return (
        _blob_height(phase, x + e, y, z) - _blob_height(phase, x - e, y, z),
        _blob_height(phase, x, y + e, z) - _blob_height(phase, x, y - e, z),
        _blob_height(phase, x, y, z + e) - _blob_height(phase, x, y, z - e),
    )
