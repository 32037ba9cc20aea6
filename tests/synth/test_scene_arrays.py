import numpy as np
import pytest

from quarc_ref.synth.furniture import make_room
from quarc_ref.synth.paints import Paint, choose_palette
from quarc_ref.synth.scene_arrays import pack_scene_arrays
from quarc_ref.synth.solids import ball, box, rotate_y, translate

_PAINT = Paint(3, (0.1,) * 3, (0.2,) * 3, (0.3,) * 3)
_FIRST_SOLID = ball(translate(1.0, 1.0, 0.0), 0.5, _PAINT)
_SECOND_SOLID = box(translate(-1.0, 1.0, 0.0) @ rotate_y(0.3), (0.1, 0.2, 0.3), _PAINT)
_THIRD_SOLID = ball(translate(0.0, 2.0, 0.0), 0.1, _PAINT)


@pytest.fixture(scope="module")
def scene_arrays():
    return pack_scene_arrays(
        [[_FIRST_SOLID, _SECOND_SOLID], [_THIRD_SOLID]], make_room(0.0, choose_palette(0))
    )


def test_groups_follow_one_another(scene_arrays):
    assert scene_arrays.groups[:, 4:].tolist() == [[0, 2], [2, 3]]


def test_the_sphere_of_a_group_contains_its_solids(scene_arrays):
    center, radius = scene_arrays.groups[0, :3], scene_arrays.groups[0, 3]
    reaches = (
        np.linalg.norm(scene_arrays.solids[:2, :3] - center, axis=1) + scene_arrays.solids[:2, 3]
    )

    assert (reaches <= radius + 1e-12).all()
    assert radius < 2


def test_matrices_map_the_world_to_the_shape(scene_arrays):
    corner = _SECOND_SOLID.matrix @ (1.0, 1.0, -1.0, 1.0)
    inverse = scene_arrays.solids[1, 4:16].reshape(3, 4)

    np.testing.assert_allclose(inverse @ corner, (1, 1, -1), atol=1e-12)


def test_paints_of_the_room_come_after_those_of_the_solids(scene_arrays):
    assert scene_arrays.paints.shape == (3 + 6, 14)
    assert (scene_arrays.paints[:3, 13] == 3).all()
    assert (scene_arrays.paints[3:, 13] != 3).all()
