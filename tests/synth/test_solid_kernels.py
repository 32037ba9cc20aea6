import numpy as np
import pytest

from quarc_ref.synth.solid_kernels import (
    BALL,
    BLOB,
    BLOB_SWELL,
    BOX,
    CAPSULE,
    CYLINDER,
    MISS,
    compute_normal,
    find_entry,
)

_SHAPES = (BALL, BOX, CYLINDER, CAPSULE, BLOB)


@pytest.mark.parametrize(
    ("shape", "origin", "direction", "distance"),
    [
        (BALL, (3.0, 0.0, 0.0), (-1.0, 0.0, 0.0), 2.0),
        (BALL, (3.0, 0.0, 0.0), (-2.0, 0.0, 0.0), 1.0),
        (BOX, (0.5, 5.0, 0.5), (0.0, -1.0, 0.0), 4.0),
        (CYLINDER, (0.0, 0.9, -4.0), (0.0, 0.0, 1.0), 3.0),
        (CYLINDER, (0.5, 5.0, 0.0), (0.0, -1.0, 0.0), 4.0),
        (CAPSULE, (4.0, 0.4, 0.0), (-1.0, 0.0, 0.0), 3.0),
        (CAPSULE, (0.0, 5.0, 0.0), (0.0, -1.0, 0.0), 3.5),
    ],
)
def test_a_ray_enters_where_the_surface_is(shape, origin, direction, distance):
    assert find_entry(shape, 0.5, *origin, *direction) == pytest.approx(distance)


@pytest.mark.parametrize("shape", _SHAPES)
def test_a_ray_that_misses_or_leaves_hits_nothing(shape):
    assert find_entry(shape, 0.5, 3.0, 0.0, 2.0, -1.0, 0.0, 0.0) == MISS
    assert find_entry(shape, 0.5, 3.0, 0.0, 0.0, 1.0, 0.0, 0.0) == MISS


@pytest.mark.parametrize("shape", _SHAPES)
def test_the_normal_faces_an_entering_ray(shape):
    generator = np.random.default_rng(shape)
    for target in generator.uniform(-0.5, 0.5, (40, 3)):
        origin = 4 * generator.standard_normal(3)
        origin *= 4 / np.linalg.norm(origin)
        direction = target - origin
        distance = find_entry(shape, 0.3, *origin, *direction)
        normal = compute_normal(shape, 0.3, *(origin + distance * direction))

        assert 0 < distance < 1
        assert np.dot(normal, direction) < 0


def test_a_blob_oscillates_around_a_ball():
    generator = np.random.default_rng(0)
    origins = generator.standard_normal((40, 3))
    origins *= 4 / np.linalg.norm(origins, axis=1, keepdims=True)
    radii = np.array([4 - 4 * find_entry(BLOB, 0.2, *origin, *-origin) for origin in origins])

    assert np.abs(radii - 1).max() < 2 * BLOB_SWELL
    assert radii.std() > 0.02
