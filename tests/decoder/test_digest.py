import zlib
from dataclasses import replace

import numpy as np

from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.digest import compute_digest, state_crc
from quarc_ref.format.records import StreamHeader
from tests.small_streams import make_gaussians

_HEADER = StreamHeader(full_crc_interval=3)
_SCENE = begin_canonical(_HEADER, 0, make_gaussians(_HEADER, 9)).scene


def _serialize(scene, *, codes):
    planes = [scene.ids, scene.positions, scene.rotations, *([scene.codes] if codes else [])]
    numbers = np.concatenate([[scene.count, scene.phase], *(plane.ravel() for plane in planes)])
    return numbers.astype("<i4").tobytes()


def test_a_crc_includes_the_codes_every_few_frames():
    for phase in range(7):
        scene = replace(_SCENE, phase=phase)
        assert state_crc(scene) == zlib.crc32(_serialize(scene, codes=phase % 3 == 0))


def test_noncontiguous_planes_are_serialized_the_same():
    noncontiguous = replace(_SCENE, positions=np.asfortranarray(_SCENE.positions))

    assert state_crc(noncontiguous) == state_crc(_SCENE)
    assert compute_digest(noncontiguous) == compute_digest(_SCENE)
