import numpy as np
import pytest

from quarc_ref.synth.furniture import compute_opening, make_cabinet, make_room, make_screen
from quarc_ref.synth.paints import choose_palette

_PALETTE = choose_palette(0)


@pytest.mark.parametrize("delay", [0.0, 0.1, 0.2])
def test_the_door_is_closed_at_first_and_open_before_the_default_clip_ends(delay):
    assert compute_opening(0.0, delay) == 0
    assert compute_opening(0.75 * 23 / 30, delay) > 0.8


def test_the_door_closes_again_and_the_motion_repeats():
    assert compute_opening(2.9, 0.0) == 0
    assert compute_opening(3.4, 0.1) == pytest.approx(compute_opening(0.4, 0.1))


def test_only_the_door_of_the_cabinet_moves_along_its_rail():
    closed, opened = (make_cabinet(share, 0.2, _PALETTE) for share in (0.0, 1.0))
    changes = [
        opened_solid.matrix - closed_solid.matrix
        for closed_solid, opened_solid in zip(closed, opened, strict=True)
    ]
    moved_indices = [index for index, change in enumerate(changes) if change.any()]
    door = closed[moved_indices[0]]

    assert len(moved_indices) == 1
    assert np.linalg.norm(changes[moved_indices[0]]) == pytest.approx(2 * door.sizes[0])
    assert abs(changes[moved_indices[0]][:3, 3] @ door.matrix[:3, 0]) == pytest.approx(
        2 * door.sizes[0] ** 2
    )


def test_the_screen_does_not_move_and_shows_the_progress_of_the_wipe():
    (start,), (later,) = make_screen(0.0, _PALETTE), make_screen(0.75, _PALETTE)

    np.testing.assert_array_equal(start.matrix, later.matrix)
    assert (start.paint.phase, later.paint.phase) == (0.0, 0.75)


def test_lamps_are_within_the_room_and_shine_along_their_normals():
    room = make_room(0.0, _PALETTE)
    low, high = room.faces[::2], room.faces[1::2]
    for lamp in room.lights:
        normal = np.cross(lamp[3:6], lamp[6:9])

        assert ((lamp[:3] > low) & (lamp[:3] < high)).all()
        np.testing.assert_allclose(normal / np.linalg.norm(normal), lamp[12:])
