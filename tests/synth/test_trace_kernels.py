import numpy as np
import pytest

from quarc_ref.synth.furniture import make_room
from quarc_ref.synth.paints import Paint, choose_palette
from quarc_ref.synth.scene_arrays import pack_scene_arrays
from quarc_ref.synth.solids import ball, translate
from quarc_ref.synth.trace_kernels import find_wall_hit, list_candidates

_PAINT = Paint(0, (0.5,) * 3, (0.5,) * 3, (0.5,) * 3)
_ROOM = np.array([-3.0, 3.0, 0.0, 2.0, -4.0, 4.0])


def _segment_distances(start, end, centers):
    """Return `[N]` distances of points to a segment."""
    shares = np.clip((centers - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
    return np.linalg.norm(centers - start - shares[:, None] * (end - start), axis=1)


@pytest.mark.parametrize(
    ("direction", "distance", "face"),
    [((1.0, 0.0, 0.0), 3.0, 1), ((0.0, -1.0, 0.0), 1.0, 2), ((0.0, 0.6, -0.8), 1 / 0.6, 3)],
)
def test_a_ray_leaves_the_room_through_the_nearest_wall(direction, distance, face):
    hit = find_wall_hit(_ROOM, (0.0, 1.0, 0.0, *direction))

    assert hit == (pytest.approx(distance), face)


def test_every_ball_on_a_ray_between_two_balls_is_listed():
    generator = np.random.default_rng(0)
    centers, radii = generator.uniform(-2, 2, (60, 3)), generator.uniform(0.01, 0.3, 60)
    solids = [
        ball(translate(*center), radius, _PAINT)
        for center, radius in zip(centers, radii, strict=True)
    ]
    scene_arrays = pack_scene_arrays([solids[:30], solids[30:]], make_room(0.0, choose_palette(0)))
    start, end = np.array([-0.5, -1.5, 0.2]), np.array([0.9, 0.6, -0.4])
    candidates = np.empty(60, dtype=np.int64)
    count = list_candidates(scene_arrays, candidates, tuple(start), 0.1, tuple(end), 0.9)
    hit_indices = set()
    for _ in range(4000):
        first, last = generator.standard_normal((2, 3))
        first *= 0.1 / np.linalg.norm(first)
        last *= 0.9 / np.linalg.norm(last)
        hit_indices |= set(
            np.flatnonzero(_segment_distances(start + first, end + last, centers) < radii).tolist()
        )

    assert hit_indices <= set(candidates[:count].tolist())
    assert 5 < len(hit_indices) <= count < 60


def test_a_ball_lists_what_overlaps_it():
    solids = [ball(translate(x, 0.0, 0.0), 0.2, _PAINT) for x in (0.0, 0.69, 0.71)]
    scene_arrays = pack_scene_arrays([solids], make_room(0.0, choose_palette(0)))
    candidates = np.empty(3, dtype=np.int64)
    count = list_candidates(scene_arrays, candidates, (0.0, 0.0, 0.0), 0.5, (0.0, 0.0, 0.0), 0.5)

    assert candidates[:count].tolist() == [0, 1]
