import io

import numpy as np
import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.decoder.decode_stream import decode_states
from quarc_ref.encoder import closed_loop
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.format.errors import ClosedLoopError, EncodeError
from quarc_ref.format.records import StreamHeader
from tests.streams import CAMERA, make_births, make_gaussians, make_symbols

_HEADER = StreamHeader(gaussians_per_anchor=4)


def _loop():
    return ClosedLoop(io.BytesIO(), _HEADER, (CAMERA,), {})


def test_what_seeds_the_next_frame_is_the_decoders_state_integer_by_integer():
    sink = io.BytesIO()
    loop = ClosedLoop(sink, _HEADER, (CAMERA,), {})
    seeds = [loop.commit_canonical(make_gaussians(_HEADER, 50), 0)]
    for frame in range(1, 5):
        begun = loop.begin_frame(frame % 2)
        moved = loop.commit_motion(make_symbols(begun, frame))
        seeds.append(loop.commit_births(make_births(moved, 2, frame)))
    loop.finish()

    decoded = list(decode_states(sink.getvalue()))

    assert len(decoded) == len(seeds)
    for mine, theirs in zip(seeds, decoded, strict=True):
        assert np.array_equal(mine.scene.ids, theirs.scene.ids)
        assert np.array_equal(mine.scene.positions, theirs.scene.positions)
        assert np.array_equal(mine.scene.rotations, theirs.scene.rotations)
        assert np.array_equal(mine.scene.codes, theirs.scene.codes)
        assert np.array_equal(mine.motion, theirs.motion)
        assert mine.next_id == theirs.next_id
        assert (mine.anchors is None) == (theirs.anchors is None)
        if mine.anchors is not None:
            assert np.array_equal(mine.anchors.binding, theirs.known_anchors.binding)


def test_a_committed_motion_is_what_the_decoder_makes_of_the_bytes():
    loop = _loop()
    loop.commit_canonical(make_gaussians(_HEADER, 50), 0)
    begun = loop.begin_frame(0)
    symbols = make_symbols(begun, 1)

    moved = loop.commit_motion(symbols)

    assert [level.tolist() for level in moved.symbols] == [level.tolist() for level in symbols]
    assert compute_digest(moved.scene) != compute_digest(begun.scene)


def test_an_encoder_that_has_another_state_than_the_decoder_is_stopped(monkeypatch):
    loop = _loop()
    monkeypatch.setattr(closed_loop, "compute_state_crc", lambda *_, **__: 0)

    with pytest.raises(ClosedLoopError):
        loop.commit_canonical(make_gaussians(_HEADER, 50), 0)


def test_a_motion_that_cannot_be_written_is_the_scenes_fault_and_not_the_streams():
    loop = ClosedLoop(io.BytesIO(), StreamHeader(translation_step=65_535), (CAMERA,), {})
    loop.commit_canonical(make_gaussians(_HEADER, 50), 0)
    begun = loop.begin_frame(0)
    far = [np.full_like(level, 60) for level in make_symbols(begun)]

    with pytest.raises(EncodeError, match="lattice"):
        loop.commit_motion(far)


def test_a_newborn_that_cannot_be_written_is_the_scenes_fault_and_not_the_streams():
    loop = _loop()
    loop.commit_canonical(make_gaussians(_HEADER, 50), 0)
    moved = loop.commit_motion(make_symbols(loop.begin_frame(0)))
    births = make_births(moved, 2)
    births.parents[:] = 50

    with pytest.raises(EncodeError, match="parent"):
        loop.commit_births(births)


def test_contexts_of_the_last_frame_are_used_where_they_save_bytes():
    def second_frame(symbols):
        loop = _loop()
        loop.commit_canonical(make_gaussians(_HEADER, 400), 0)
        for _ in range(2):
            loop.begin_frame(0)
            loop.commit_motion(symbols)
            chunk = loop._chunk
            loop.commit_births(None)
        return chunk

    probe = _loop()
    probe.commit_canonical(make_gaussians(_HEADER, 400), 0)
    symbols = make_symbols(probe.begin_frame(0), share=0.1)

    assert second_frame([2 * level for level in symbols]).previous_contexts
    assert not second_frame([0 * level for level in symbols]).previous_contexts
