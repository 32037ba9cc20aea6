from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.format import wire
from quarc_ref.format.coding import entropy
from quarc_ref.format.container import build_chunk
from quarc_ref.format.errors import BitstreamError, TruncatedError, VerificationError
from quarc_ref.inspection import verify_stream as verify_module
from quarc_ref.inspection.verify_stream import verify_stream
from quarc_ref.streams import BytesSource, Follow
from quarc_ref.streams.chunk_reader import split_chunks
from tests.small_streams import make_stream

_DATA, _STATES = make_stream(gaussian_count=30, frame_count=8, canonical_every=3)
_CHUNKS = list(split_chunks(_DATA))


def test_the_verification_counts_all_checks():
    calls = []
    verification = verify_stream(BytesSource(_DATA), lambda *arguments: calls.append(arguments))

    births = [wire.parse_frame(chunk.payload) for chunk in _CHUNKS if chunk.kind == b"FRAM"]
    assert (verification.frames, verification.chunks) == (8, len(_CHUNKS))
    assert (verification.seek_points, verification.frames_compared) == (3, 8)
    assert verification.maxima == {
        "gaussians": max(state.scene.count for state in _STATES),
        "births": max(frame.birth_count for frame in births),
        "chunk_bytes": max(len(chunk.payload) for chunk in _CHUNKS[1:]),
    }
    assert verification.limits == {"gaussians": 65536, "births": 4096, "chunk_bytes": 1 << 22}
    assert verification.sha256 == compute_digest(_STATES[-1].scene)
    assert verification.entropy_decoders == (2 if entropy.HAS_CONSTRICTION else 1)
    frame_chunks = [chunk for chunk in _CHUNKS if chunk.kind == b"FRAM"]
    assert verification.sections == 6 * 3 + 2 * len(frame_chunks)
    assert verification.bits > 0
    stages = [stage for stage, _, _ in calls]
    assert stages == ["decode"] * 8 + ["seek"] * 8
    assert {total for _, _, total in calls} == {8}


def test_a_stream_without_frames_is_verified():
    data, _ = make_stream(gaussian_count=5, frame_count=1)
    chunks = list(split_chunks(data))
    tail = wire.build_tail(wire.Tail(0, 0, 0))
    body = data[: chunks[3].offset]
    verification = verify_stream(BytesSource(body + build_chunk(b"TAIL", 3, tail)))

    assert (verification.frames, verification.sha256, verification.seek_points) == (0, None, 0)
    assert (verification.maxima["gaussians"], verification.maxima["births"]) == (0, 0)


def test_a_seek_point_that_gives_another_state_is_detected(monkeypatch):
    decode = verify_module.decode

    def decode_another(source, start, stop):
        for scene in decode(source, start, stop):
            codes = scene.codes + (scene.frame == 4)
            yield replace(scene, codes=codes.astype(np.int16))

    monkeypatch.setattr(verify_module, "decode", decode_another)
    with pytest.raises(
        VerificationError, match="frame 4 decodes to a different state from seek point 3"
    ):
        verify_stream(BytesSource(_DATA))


@pytest.mark.parametrize("size", range(0, len(_DATA), 211))
def test_a_truncated_stream_is_not_verified(size):
    with pytest.raises(TruncatedError):
        verify_stream(BytesSource(_DATA[:size]))
    with pytest.raises(TruncatedError):
        verify_stream(BytesSource(_DATA[:size]), follow=Follow(interval=0.001, patience=0.002))


@pytest.mark.parametrize("offset", range(30, len(_DATA), 101))
def test_damage_is_found(offset):
    damaged = bytearray(_DATA)
    damaged[offset] ^= 16

    with pytest.raises(BitstreamError):
        verify_stream(BytesSource(bytes(damaged)))
