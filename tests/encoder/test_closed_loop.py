import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quarc_ref.decoder import StreamDecoder, compute_digest
from quarc_ref.decoder.rotation import expand_rotations
from quarc_ref.decoder.scene import Scene
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.encoder.requantize import find_representable, requantize
from quarc_ref.format import wire
from quarc_ref.format.constants import ROTATION_ONE
from quarc_ref.format.container import CANO, FRAM, SNAP, Chunk
from quarc_ref.format.errors import ClosedLoopError, EncodeError, ResumeError
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.decode_stream import decode_states
from tests import strategies
from tests.small_streams import CAMERA, make_births, make_gaussians, make_stream, make_symbols

_HEADER = StreamHeader(gaussians_per_anchor=4)


def _make_loop():
    return ClosedLoop(io.BytesIO(), _HEADER, (CAMERA,), {})


def test_the_next_frame_starts_from_exactly_the_decoders_state():
    sink = io.BytesIO()
    loop = ClosedLoop(sink, _HEADER, (CAMERA,), {})
    states = [loop.commit_canonical(make_gaussians(_HEADER, 50), 0)]
    for frame in range(1, 5):
        moved_frame = _move_next_frame(loop, frame % 2, frame)
        states.append(loop.commit_frame(moved_frame, make_births(moved_frame.state, 2, frame)))
    loop.finish()

    decoded = list(decode_states(sink.getvalue()))

    assert len(decoded) == len(states)
    for encoded, decoded_state in zip(states, decoded, strict=True):
        assert np.array_equal(encoded.scene.ids, decoded_state.scene.ids)
        assert np.array_equal(encoded.scene.positions, decoded_state.scene.positions)
        assert np.array_equal(encoded.scene.rotations, decoded_state.scene.rotations)
        assert np.array_equal(encoded.scene.codes, decoded_state.scene.codes)
        assert np.array_equal(encoded.motion, decoded_state.motion)
        assert encoded.next_id == decoded_state.next_id
        assert (encoded.anchors is None) == (decoded_state.anchors is None)
        if encoded.anchors is not None:
            assert np.array_equal(encoded.anchors.binding, decoded_state.required_anchors.binding)


def test_a_loop_that_has_replayed_its_frames_continues_as_if_it_had_written_them():
    data, _ = make_stream(_HEADER, frame_count=4, canonical_every=3)
    chunks = [chunk for chunk in split_chunks(data) if chunk.kind in (CANO, FRAM)]
    existing_bytes = chunks[2].offset
    sink = io.BytesIO(data[:existing_bytes])
    sink.seek(existing_bytes)
    loop = ClosedLoop(sink, _HEADER, (CAMERA,), {"capture": "made by hand"}, existing_bytes)
    sizes = []
    for chunk in chunks[:2]:
        loop.replay(chunk)
        sizes.append(loop.frame_bytes)
    for frame in (2, 3):
        moved_frame = _move_next_frame(loop, max(0, loop.state.scene.count - 40), frame)
        commit = loop.commit_frame if frame == 2 else loop.commit_as_canonical
        commit(moved_frame, make_births(moved_frame.state, 3, frame) if frame % 2 else None)
    loop.finish()

    assert sink.getvalue() == data
    assert sizes == [chunk.byte_count() for chunk in chunks[:2]]


def test_a_frame_that_the_decoder_rejects_cannot_be_replayed():
    loop = _make_loop()
    frames = [chunk for chunk in split_chunks(make_stream(_HEADER)[0]) if chunk.kind == FRAM]
    with pytest.raises(ResumeError, match="canonical frame"):
        loop.replay(frames[0])
    with pytest.raises(ValueError, match="came chunk does not contain a frame"):
        loop.replay(Chunk(b"came", wire.build_cameras(()), 0, 0))


def test_a_committed_motion_equals_the_decoded_one():
    loop = _make_loop()
    loop.commit_canonical(make_gaussians(_HEADER, 50), 0)
    start = loop.start_frame(0)
    symbols = make_symbols(start.state, 1)

    moved_frame = loop.move_frame(start, symbols).state

    assert [level.tolist() for level in moved_frame.symbols] == [
        level.tolist() for level in symbols
    ]
    assert compute_digest(moved_frame.scene) != compute_digest(start.state.scene)


def test_an_encoder_whose_state_differs_from_the_decoders_is_stopped(monkeypatch):
    loop = _make_loop()
    monkeypatch.setattr(loop.engine, "state_crc", lambda _: 0)

    with pytest.raises(ClosedLoopError):
        loop.commit_canonical(make_gaussians(_HEADER, 50), 0)


def test_a_frame_is_decoded_once_and_again_if_a_byte_differs(monkeypatch):
    loop, moved_frame = _make_moved_frame(_HEADER)
    decode_calls = []
    decode_frame = loop.engine.decode_frame

    def record_call(state, chunk):
        decode_calls.append(chunk)
        return decode_frame(state, chunk)

    monkeypatch.setattr(loop.engine, "decode_frame", record_call)
    births = make_births(moved_frame.state, 2)

    first_state = loop.commit_frame(moved_frame, births)

    assert loop.state is first_state
    assert decode_calls == []

    moved_frame = _move_next_frame(loop, 0, 2)
    store = loop._decoder.store
    monkeypatch.setattr(
        loop._decoder,
        "store",
        lambda before, chunk, after: store(before, replace(chunk, death_count=1), after),
    )

    loop.commit_frame(moved_frame, None)

    assert len(decode_calls) == 1
    assert (loop.state.scene.frame, loop.state.scene.count) == (2, 49)


def test_a_motion_that_cannot_be_written_is_an_error_of_the_scene():
    loop = ClosedLoop(io.BytesIO(), StreamHeader(translation_step=65_535), (CAMERA,), {})
    loop.commit_canonical(make_gaussians(_HEADER, 50), 0)
    start = loop.start_frame(0)
    far_symbols = [np.full_like(level, 60) for level in make_symbols(start.state)]

    with pytest.raises(EncodeError, match="lattice"):
        loop.move_frame(start, far_symbols)


def test_a_newborn_that_cannot_be_written_is_an_error_of_the_scene():
    loop = _make_loop()
    loop.commit_canonical(make_gaussians(_HEADER, 50), 0)
    moved_frame = _move_next_frame(loop, 0)
    births = make_births(moved_frame.state, 2)
    births.parents[:] = 50

    with pytest.raises(EncodeError, match="parent"):
        loop.commit_frame(moved_frame, births)


def test_a_frame_is_committed_only_after_the_frame_it_started_from():
    loop, moved_frame = _make_moved_frame(_HEADER)
    loop.commit_frame(moved_frame, None)

    for commit in (loop.commit_frame, loop.commit_as_canonical):
        with pytest.raises(ValueError, match="does not follow"):
            commit(moved_frame, None)


_POSITION_ERROR = "position-range"


def _make_moved_frame(header, sink=None):
    """Return a loop and its second frame after the motion."""
    loop = ClosedLoop(sink or io.BytesIO(), header, (CAMERA,), {})
    loop.commit_canonical(make_gaussians(header, 50), 0)
    return loop, _move_next_frame(loop, 3)


def _move_next_frame(loop, deaths, seed=0):
    """Return the next frame of a loop after a random motion."""
    start = loop.start_frame(deaths)
    return loop.move_frame(start, make_symbols(start.state, seed))


@given(strategies.headers())
@settings(max_examples=25)
def test_a_frame_can_be_written_as_a_canonical_one(header):
    sink = io.BytesIO()
    loop, moved_frame = _make_moved_frame(header, sink)
    births = make_births(moved_frame.state, 4, 1)
    section = loop.engine.write_births(moved_frame.state, births)
    expected_state = loop.engine.decode_births(moved_frame.state, section, 4)

    state = loop.commit_as_canonical(moved_frame, births)
    start = loop.start_frame(1)
    zero_symbols = [0 * level for level in make_symbols(start.state)]
    loop.commit_frame(loop.move_frame(start, zero_symbols), None)
    loop.finish()

    assert (state.scene.frame, state.scene.phase, state.next_id) == (1, 0, 51)
    _check_near(state.scene, expected_state.scene, header)
    decoder, last_state = StreamDecoder(), None
    for chunk in split_chunks(sink.getvalue()):
        last_state = decoder.push(chunk) or last_state
    assert (last_state.scene.frame, last_state.scene.phase) == (2, 1)
    assert [point.frame for point in decoder.index] == [0, 1]


def _check_near(scene, expected, header):
    """Check that the scenes match up to the rounding to the grid of canonical frames."""
    distances = np.abs(scene.positions[:, :, None] - expected.positions[:, None]).max(axis=0)
    has_same_codes = (scene.codes[:, :, None] == expected.codes[:, None]).all(axis=0)
    dot_products = np.abs(scene.rotations.astype(float).T @ expected.rotations.astype(float)) / (
        1 << 44
    )
    is_angle_close = 1 - dot_products <= 3 * (1 / (1 << header.rotation_bits)) ** 2 + 1e-6
    matches = (distances <= (header.position_step + 1) // 2) & has_same_codes & is_angle_close
    assert matches.any(axis=0).all()
    assert matches.any(axis=1).all()


def test_a_frame_out_of_range_of_canonical_steps_is_an_error_of_the_scene():
    header = StreamHeader(position_step=5000, translation_step=1, gaussians_per_anchor=1)
    loop = ClosedLoop(io.BytesIO(), header, (CAMERA,), {})
    gaussians = make_gaussians(header, 20)
    gaussians.positions[:] = 0
    gaussians.positions[0, 0] = 1677
    loop.commit_canonical(gaussians, 0)
    for _ in range(14):
        start = loop.start_frame(0)
        symbols = [0 * level for level in make_symbols(start.state)]
        for level in symbols:
            level[0] = 60
        moved_frame = loop.move_frame(start, symbols)
        if moved_frame.state.scene.positions.max() > 8_387_500:
            break
        loop.commit_frame(moved_frame, None)

    with pytest.raises(EncodeError, match=_POSITION_ERROR):
        loop.commit_as_canonical(moved_frame, None)


@pytest.mark.parametrize("kind", [CANO, SNAP])
@pytest.mark.parametrize(("offset", "kept"), [(10, 4), (11, 3)])
def test_gaussians_too_far_away_for_a_canonical_frame_are_dropped(kind, offset, kept):
    sink = io.BytesIO()
    header = replace(_HEADER, position_step=2, snapshots=True)
    loop = ClosedLoop(sink, header, (CAMERA,), {})
    gaussians = make_gaussians(header, 3)
    first, middle, last = 0, (1 << 19) - 1, (1 << 20) - 11
    gaussians.positions[:] = [[first, middle, last], [0] * 3, [0] * 3]
    loop.commit_canonical(gaussians, 0)
    start = loop.start_frame(0)
    moved_frame = loop.move_frame(start, [0 * level for level in make_symbols(start.state)])
    births = replace(make_births(moved_frame.state, 1), parents=np.array([2]))
    births.newborn.positions[:] = [[offset], [0], [0]]
    commit = loop.commit_as_canonical if kind == CANO else loop.commit_as_snapshot

    state = commit(moved_frame, births)
    loop.finish()

    positions = state.scene.positions[0] // 2
    assert sorted(positions) == [first, middle, last, last + offset][:kept]
    decoded = list(decode_states(sink.getvalue()))
    assert np.array_equal(decoded[-1].scene.positions, state.scene.positions)


def test_a_scene_that_is_far_from_its_median_is_an_error():
    far = 1 << 21
    positions = np.array([[0, far, far], [far, 0, far], [far, far, 0]], np.int64)

    with pytest.raises(EncodeError, match=r"wider .* increase steps.position_pixels"):
        find_representable(positions - 5 * far * np.eye(3, dtype=np.int64))


@given(st.integers(1, 14), st.integers(0, (1 << 32) - 1))
def test_every_rotation_can_be_requantized_on_every_grid(bits, seed):
    rng = np.random.default_rng(seed)
    header = StreamHeader(rotation_bits=bits, sh_degree=0)
    quaternions = rng.normal(size=(4, 200)) * rng.choice([1, 1, 0.01, 0], (4, 200))
    quaternions[0] += ~quaternions.any(axis=0)
    unit = np.round(quaternions / np.linalg.norm(quaternions, axis=0) * ROTATION_ONE)
    scene = Scene(
        header, 0, 0, np.arange(200), np.zeros((3, 200), np.int32), unit.astype(np.int32),
        np.zeros((7, 200), np.int16),
    )  # fmt: skip

    requantized_rotations = expand_rotations(requantize(scene).rotations, bits)

    dot_products = (
        np.abs((requantized_rotations.astype(float) * unit).sum(axis=0)) / ROTATION_ONE**2
    )
    assert np.all(1 - dot_products <= 3 * (1 / (1 << bits)) ** 2 + 1e-6)


def test_contexts_of_the_last_frame_are_used_if_they_save_bytes():
    def encode_second_frame(symbols):
        loop = _make_loop()
        loop.commit_canonical(make_gaussians(_HEADER, 400), 0)
        for _ in range(2):
            moved_frame = loop.move_frame(loop.start_frame(0), symbols)
            loop.commit_frame(moved_frame, None)
        return moved_frame.chunk

    probe_loop = _make_loop()
    probe_loop.commit_canonical(make_gaussians(_HEADER, 400), 0)
    symbols = make_symbols(probe_loop.start_frame(0).state, share=0.1)

    assert encode_second_frame([2 * level for level in symbols]).previous_contexts
    assert not encode_second_frame([0 * level for level in symbols]).previous_contexts
