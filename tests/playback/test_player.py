import gc
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from quarc_ref.decoder import compute_digest, dequantize
from quarc_ref.decoder.engines import use_engine
from quarc_ref.format import container
from quarc_ref.format.constants import CHUNK_HEADER_BYTES
from quarc_ref.format.errors import BitstreamError, StateCrcError
from quarc_ref.playback import Player, frame_pipeline
from quarc_ref.streams import BytesSource, decode
from quarc_ref.streams.chunk_reader import split_chunks
from tests.engines import engines
from tests.small_streams import CountedSource, make_stream, rebuild_stream

_STREAM, _STATES = make_stream(frame_count=12, canonical_every=5)
_DIGESTS = [compute_digest(state.scene) for state in _STATES]

with_and_without_prefetch = pytest.mark.parametrize("threads", [1, 2])


def _list_values(splats):
    return [
        getattr(splats, name).tolist()
        for name in ("positions", "rotations", "log_scales", "opacities", "sh")
    ]


@pytest.mark.parametrize("threads", [1, 2, 4])
@engines
def test_the_frames_equal_the_encoded_frames(threads, engine):
    expected = [_list_values(dequantize(state.scene)) for state in _STATES]
    with use_engine(engine), Player(_STREAM, threads=threads) as player:
        for frame, digest, values in zip(player, _DIGESTS, expected, strict=True):
            assert compute_digest(frame.scene) == digest
            assert _list_values(frame.splats) == values
            assert frame.chunk_bytes > 0
            assert frame.nanoseconds > 0


@with_and_without_prefetch
def test_a_part_is_played_from_its_seek_point(threads):
    source = CountedSource(_STREAM)
    with Player(source, threads=threads) as player:
        ordinals = [frame.scene.frame for frame in player.frames(7, 9)]

    assert ordinals == [7, 8]
    assert source.byte_count() < len(_STREAM) / 2 + 2000


def _change_payload(chunk_index, change):
    """Return the stream with a changed payload in one chunk, and correct CRCs."""
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(_STREAM)]
    kind, payload = chunks[chunk_index]
    chunks[chunk_index] = (kind, change(payload))
    return rebuild_stream(chunks)


def _frames_until_rejected(player):
    digests = []
    with pytest.raises(BitstreamError) as rejection:
        digests.extend(compute_digest(frame.scene) for frame in player)
    return digests, rejection.value


@with_and_without_prefetch
@pytest.mark.parametrize("number", [3, 4, 6])
def test_a_fault_is_raised_at_its_frame(number, threads):
    damaged = bytearray(_STREAM)
    chunk = list(split_chunks(_STREAM))[number]
    damaged[chunk.offset + CHUNK_HEADER_BYTES + 9] ^= 1
    expected = _frames_until_rejected_by_decode(bytes(damaged))

    with Player(bytes(damaged), threads=threads) as player:
        digests, error = _frames_until_rejected(player)

    assert (digests, error.reject_id, error.offset) == expected


def _frames_until_rejected_by_decode(data):
    digests = []
    with pytest.raises(BitstreamError) as rejection:
        digests.extend(compute_digest(scene) for scene in decode(data))
    return digests, rejection.value.reject_id, rejection.value.offset


@with_and_without_prefetch
def test_a_state_with_a_wrong_crc_is_never_returned(threads):
    number = next(
        index for index, chunk in enumerate(split_chunks(_STREAM)) if chunk.kind == container.FRAM
    )
    reject_ids = set()
    for position in range(20):
        changed_stream = _change_payload(number, lambda p, offset=position: _flip(p, offset))
        expected = _frames_or_fault(decode(changed_stream))
        with Player(changed_stream, threads=threads) as player:
            assert _frames_or_fault(frame.scene for frame in player) == expected
        reject_ids.add(expected[1])
    assert StateCrcError.reject_id in reject_ids


def _flip(payload, position):
    return payload[:position] + bytes([payload[position] ^ 1]) + payload[position + 1 :]


def _frames_or_fault(scenes):
    digests = []
    try:
        digests.extend(compute_digest(scene) for scene in scenes)
    except BitstreamError as error:
        return digests, error.reject_id, error.offset
    return digests, None, None


@engines
def test_arrays_stay_valid_as_long_as_they_are_referenced(engine):
    with use_engine(engine), Player(_STREAM, threads=2) as player:
        frames = player.frames()
        first = next(frames)
        first_values = _list_values(first.splats)
        later_splats = [frame.splats for frame in frames]

        assert _list_values(first.splats) == first_values
        assert not np.array_equal(later_splats[0].positions, first_values[0])


@pytest.mark.parametrize("threads", [1, 2])
def test_a_player_without_references_leaves_no_thread_behind(threads):
    thread_count = threading.active_count()
    next(iter(Player(_STREAM, threads=threads)))
    gc.collect()

    deadline = time.monotonic() + 20
    while threading.active_count() > thread_count and time.monotonic() < deadline:
        time.sleep(0.01)
    assert threading.active_count() == thread_count


@pytest.mark.parametrize("threads", [0, -2])
def test_at_least_one_thread_is_required(threads):
    with pytest.raises(ValueError, match="at least"):
        Player(_STREAM, threads=threads)


def test_the_time_of_the_source_is_not_decoding_time(monkeypatch):
    source = CountedSource(_STREAM)
    clock = SimpleNamespace(perf_counter_ns=lambda: len(source.reads))
    monkeypatch.setattr(frame_pipeline, "time", clock)
    with Player(source, threads=1) as player:
        assert [frame.nanoseconds for frame in player] == [0] * 12

    assert len(source.reads) > 12


def test_a_closed_player_leaves_no_thread_behind():
    thread_count = threading.active_count()
    player = Player(BytesSource(_STREAM), threads=2)
    next(player.frames())
    assert threading.active_count() > thread_count

    player.close()

    assert threading.active_count() == thread_count
    with player:
        next(player.frames())
    assert threading.active_count() == thread_count


def test_the_stages_are_timed():
    with Player(_STREAM) as player:
        list(player)

    assert player.times.keys() == {"decode", "floats"}
