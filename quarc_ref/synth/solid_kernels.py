"""Kernels that intersect rays with solids and compute the normals of solids.

Every solid is one of five shapes of about unit size, mapped to the world by an affine
matrix. The caller maps rays to the space of the shape. Mapped directions are not
normalized, so distances along a mapped ray and the original ray are equal. A ray that starts inside
a solid does not intersect the solid, unless the solid is a blob.
"""

# mypy: allow-untyped-defs

import math

from quarc_ref.synth.compiled import inlined_kernel

BALL = 0
BOX = 1
CYLINDER = 2
CAPSULE = 3
BLOB = 4

MISS = 1e30
BLOB_SWELL = 0.16
_BLOB_FREQUENCY = 0.43
_BLOB_STEP_FACTOR = 0.62  # step / height; below 1, because waves make the surface steeper
_MAX_BLOB_STEPS = 48
_BLOB_TOLERANCE = 1e-3
_GRADIENT_STEP = 1e-3
_EPSILON = 1e-12


@inlined_kernel
def find_entry(shape, parameter, ox, oy, oz, dx, dy, dz):
    """Return the distance at which a ray enters a shape, or `MISS` if it misses the shape.

    Args:
        shape: `BALL`, `BOX`, `CYLINDER`, `CAPSULE` or `BLOB`.
        parameter: For a capsule, half the length of its axis in units of its radius; for a blob,
            the phase of its waves in turns; unused for other shapes.
        ox, oy, oz: Origin of the ray in the shape's space.
        dx, dy, dz: Direction of the ray in the shape's space.
    """
    if shape == BALL:
        return _find_ball_entry(ox, oy, oz, dx, dy, dz)
    if shape == BOX:
        return _find_box_entry(ox, oy, oz, dx, dy, dz)
    if shape == CYLINDER:
        return _find_cylinder_entry(ox, oy, oz, dx, dy, dz)
    if shape == CAPSULE:
        return _find_capsule_entry(parameter, ox, oy, oz, dx, dy, dz)
    return _find_blob_entry(parameter, ox, oy, oz, dx, dy, dz)


@inlined_kernel
def compute_normal(shape, parameter, x, y, z):
    """Return an outward normal, of any length, at a point of a shape's surface."""
    if shape == BOX:
        return _box_normal(x, y, z)
    if shape == CYLINDER:
        if abs(y) > math.sqrt(x * x + z * z):
            return 0.0, y, 0.0
        return x, 0.0, z
    if shape == CAPSULE:
        return x, y - min(max(y, -parameter), parameter), z
    if shape == BLOB:
        return _blob_normal(parameter, x, y, z)
    return x, y, z


@inlined_kernel
def _find_ball_entry(ox, oy, oz, dx, dy, dz):
    a = dx * dx + dy * dy + dz * dz
    b = ox * dx + oy * dy + oz * dz
    c = ox * ox + oy * oy + oz * oz - 1
    discriminant = b * b - a * c
    if discriminant < 0 or b >= 0 or c < 0:
        return MISS
    return (-b - math.sqrt(discriminant)) / a


@inlined_kernel
def _intersect_slab(origin, direction):
    """Return the distances at which a coordinate of a ray enters and leaves the range -1 to 1."""
    if abs(direction) < _EPSILON:
        direction = _EPSILON
    low_face, high_face = (-1 - origin) / direction, (1 - origin) / direction
    return min(low_face, high_face), max(low_face, high_face)


@inlined_kernel
def _find_box_entry(ox, oy, oz, dx, dy, dz):
    x0, x1 = _intersect_slab(ox, dx)
    y0, y1 = _intersect_slab(oy, dy)
    z0, z1 = _intersect_slab(oz, dz)
    entry_distance, exit_distance = max(x0, y0, z0), min(x1, y1, z1)
    return entry_distance if 0 < entry_distance <= exit_distance else MISS


@inlined_kernel
def _box_normal(x, y, z):
    if abs(x) >= abs(y) and abs(x) >= abs(z):
        return x, 0.0, 0.0
    if abs(y) >= abs(z):
        return 0.0, y, 0.0
    return 0.0, 0.0, z


@inlined_kernel
def _find_cylinder_entry(ox, oy, oz, dx, dy, dz):
    a = max(dx * dx + dz * dz, _EPSILON)
    b = ox * dx + oz * dz
    discriminant = b * b - a * (ox * ox + oz * oz - 1)
    if discriminant < 0:
        return MISS
    root = math.sqrt(discriminant)
    low, high = _intersect_slab(oy, dy)
    entry_distance, exit_distance = max((-b - root) / a, low), min((-b + root) / a, high)
    return entry_distance if 0 < entry_distance <= exit_distance else MISS


@inlined_kernel
def _find_capsule_entry(half_length, ox, oy, oz, dx, dy, dz):
    a = max(dx * dx + dz * dz, _EPSILON)
    b = ox * dx + oz * dz
    discriminant = b * b - a * (ox * ox + oz * oz - 1)
    if discriminant < 0:
        return MISS
    entry_distance = (-b - math.sqrt(discriminant)) / a
    y = oy + entry_distance * dy
    if abs(y) <= half_length:
        return entry_distance if entry_distance > 0 else MISS
    return _find_ball_entry(ox, oy - math.copysign(half_length, y), oz, dx, dy, dz)


@inlined_kernel
def _approximate_sine(x):
    """Return an inexpensive approximation of the sine of x turns."""
    x -= math.floor(x + 0.5)
    return 8 * x * (1 - 2 * abs(x))


@inlined_kernel
def _blob_height(phase, x, y, z):
    waves = _approximate_sine(_BLOB_FREQUENCY * x + phase) * _approximate_sine(
        _BLOB_FREQUENCY * y + 0.11 - 2 * phase
    )
    waves += _approximate_sine(_BLOB_FREQUENCY * z + 0.21 + phase) * _approximate_sine(
        _BLOB_FREQUENCY * y + phase
    )
    return math.sqrt(x * x + y * y + z * z) - 1 + BLOB_SWELL * waves


@inlined_kernel
def _find_blob_entry(phase, ox, oy, oz, dx, dy, dz):
    a = dx * dx + dy * dy + dz * dz
    b = ox * dx + oy * dy + oz * dz
    c = ox * ox + oy * oy + oz * oz - (1 + 2 * BLOB_SWELL) ** 2
    discriminant = b * b - a * c
    if discriminant < 0:
        return MISS
    root = math.sqrt(discriminant)
    distance, exit_distance = max(0.0, (-b - root) / a), (-b + root) / a
    for _ in range(_MAX_BLOB_STEPS):
        if distance > exit_distance:
            break
        height = _blob_height(phase, ox + distance * dx, oy + distance * dy, oz + distance * dz)
        if height < _BLOB_TOLERANCE:
            return distance
        distance += max(height * _BLOB_STEP_FACTOR, _BLOB_TOLERANCE) / math.sqrt(a)
    return MISS


@inlined_kernel
def _blob_normal(phase, x, y, z):
    step = _GRADIENT_STEP
    return (
        _blob_height(phase, x + step, y, z) - _blob_height(phase, x - step, y, z),
        _blob_height(phase, x, y + step, z) - _blob_height(phase, x, y - step, z),
        _blob_height(phase, x, y, z + step) - _blob_height(phase, x, y, z - step),
    )
