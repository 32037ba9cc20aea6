from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.reconstruct import begin_frame
from quarc_ref.format.records import StreamHeader
from tests.small_streams import make_gaussians

_HEADER = StreamHeader()
_STATE = begin_canonical(_HEADER, 0, make_gaussians(_HEADER, 9))


@pytest.mark.parametrize("name", ["positions", "rotations", "codes"])
def test_a_scene_has_planes_of_the_same_length_and_dtype(name):
    plane = getattr(_STATE.scene, name)

    for wrong_plane in (plane[:, 1:], plane[1:], plane.astype(np.int64)):
        with pytest.raises(ValueError, match=name):
            replace(_STATE.scene, **{name: wrong_plane})


@pytest.mark.parametrize("name", ["ids", "positions", "rotations", "codes"])
def test_a_program_cannot_change_the_frame_from_which_the_next_one_is_decoded(name):
    with pytest.raises(ValueError, match="read-only"):
        getattr(_STATE.scene, name)[...] = 0


def test_the_remaining_gaussians_keep_their_order():
    scene = _STATE.scene.without(np.array([1, 3, 5, 7]))

    assert scene.count == 5
    assert scene.ids.tolist() == [0, 2, 4, 6, 8]
    assert np.array_equal(scene.positions, _STATE.scene.positions[:, ::2])
    assert np.array_equal(scene.codes, _STATE.scene.codes[:, ::2])


def test_a_canonical_frame_has_no_anchors():
    with pytest.raises(ValueError, match="begin_frame"):
        _ = _STATE.required_anchors
    assert begin_frame(_STATE, 0).required_anchors.levels
