"""Recoloring changes only SH steps and the codes of SH DC."""

import io
from pathlib import Path

import numpy as np
import pytest

from quarc_ref.decoder import dequantize
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.encoder.scenes.recolor import Recoloring, recolor
from quarc_ref.format import container, wire
from quarc_ref.format.errors import BitstreamError, EncodeError
from quarc_ref.format.records import SH_DC, StreamHeader
from quarc_ref.streams import decode
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.decode_stream import decode_states
from quarc_ref.streams.source import BytesSource
from quarc_ref.streams.stream_writer import StreamWriter
from tests.encoder.toys import make_cameras
from tests.small_streams import make_stream

_BASE = 0.28209479177387814
_STREAMS = Path(__file__).parents[3] / "conformance" / "streams"


def recolor_stream(data, recoloring):
    sink = io.BytesIO()
    count = recolor(BytesSource(data), sink, recoloring)
    assert count == len(list(decode(data)))
    return sink.getvalue()


@pytest.mark.parametrize("updates", [True, False])
@pytest.mark.parametrize("canonical_every", [2, 99])
def test_everything_but_the_base_colors_is_unchanged(updates, canonical_every):
    header = StreamHeader(seed=7, gaussians_per_anchor=4, updates=updates, rotation_components=4)
    data, _ = make_stream(header, frame_count=6, canonical_every=canonical_every)
    recolored_data = recolor_stream(data, Recoloring(offset=(0.1, 0.0, -0.2)))
    code_offsets = np.rint(np.array([0.1, 0.0, -0.2]) / (_BASE * header.sh_dc_step))

    for original, recolored in zip(decode_states(data), decode_states(recolored_data), strict=True):
        for plane in ("ids", "positions", "rotations"):
            first, second = getattr(original.scene, plane), getattr(recolored.scene, plane)
            assert np.array_equal(first, second)
        assert np.array_equal(original.motion, recolored.motion)
        differences = recolored.scene.codes.astype(int) - original.scene.codes
        assert np.array_equal(
            differences[SH_DC], np.broadcast_to(code_offsets[:, None], differences[SH_DC].shape)
        )
        assert not np.any(np.delete(differences, np.r_[SH_DC], axis=0))


@pytest.mark.parametrize("name", ["roomy-box", "snapshots-roomy-box"])
def test_gaussians_in_a_box_that_is_not_the_smallest_keep_their_order(name):
    data = (_STREAMS / f"{name}.quarc").read_bytes()
    recolored_data = recolor_stream(data, Recoloring(offset=(0.1, 0.0, -0.2)))

    for original, recolored in zip(decode(data), decode(recolored_data), strict=True):
        assert np.array_equal(original.positions, recolored.positions)
        assert np.array_equal(original.rotations, recolored.rotations)


def test_a_gain_multiplies_the_visible_color():
    data, _ = make_stream(StreamHeader(seed=7, gaussians_per_anchor=4))
    gain = 1.3
    recolored_data = recolor_stream(data, Recoloring(gain=gain))

    for original, recolored in zip(decode(data), decode(recolored_data), strict=True):
        original_splats, recolored_splats = dequantize(original), dequantize(recolored)
        colors, expected_colors = (
            0.5 + _BASE * recolored_splats.sh[:, 0],
            gain * (0.5 + _BASE * original_splats.sh[:, 0]),
        )
        half_step = _BASE * recolored.header.sh_dc_step / 2
        assert np.abs(colors - expected_colors).max() <= half_step * 1.01
        assert recolored_splats.sh[:, 1:] == pytest.approx(
            gain * original_splats.sh[:, 1:], rel=1e-6
        )


def test_cameras_and_metadata_change_at_the_same_frames():
    cameras = [tuple(make_cameras(count)) for count in (2, 3, 4)]
    changes = {0: (cameras[0], "a"), 2: (cameras[1], "b"), 4: (cameras[2], "c")}
    data = _write_with_changes(changes)

    assert _list_side_data(recolor_stream(data, Recoloring(gain=1.5))) == _list_side_data(data)
    assert len({metadata["note"] for _, metadata in _list_side_data(data)}) == 3


def _write_with_changes(changes):
    """Return a stream of four frames, before which, and after the last, side data changes."""
    data, _ = make_stream(StreamHeader(seed=7, gaussians_per_anchor=4), frame_count=4)
    chunks = list(split_chunks(data))
    sink = io.BytesIO()
    writer = StreamWriter(sink, chunks[0].payload)
    frames = [chunk for chunk in chunks if chunk.kind in container.FRAME_TYPES]
    for number in range(len(frames) + 1):
        if number in changes:
            cameras, note = changes[number]
            writer.write(container.CAME, wire.build_cameras(cameras))
            writer.write(container.META, wire.build_metadata({"note": note}))
        if number < len(frames):
            writer.write(frames[number].kind, frames[number].payload)
    writer.finish()
    return sink.getvalue()


def _list_side_data(data):
    """Return cameras and metadata at every frame, and at the end."""
    decoder = StreamDecoder()
    at_frames = [(decoder.cameras, decoder.metadata) for _ in decode(data, decoder=decoder)]
    return [*at_frames, (decoder.cameras, decoder.metadata)]


def test_snapshots_become_canonical_frames_of_the_same_state():
    header = StreamHeader(seed=7, gaussians_per_anchor=4, snapshots=True, updates=True)
    data, _ = make_stream(header, frame_count=6, snapshot_every=2)
    recolored_data = recolor_stream(data, Recoloring(gain=2.0))

    for original, recolored in zip(decode(data), decode(recolored_data), strict=True):
        assert original.phase == recolored.phase
        assert np.array_equal(original.positions, recolored.positions)
        assert np.array_equal(original.rotations, recolored.rotations)


def test_an_identity_recoloring_gives_the_same_bytes():
    data, _ = make_stream(StreamHeader(seed=7, gaussians_per_anchor=4, updates=True))

    assert recolor_stream(data, Recoloring()) == data


@pytest.mark.parametrize("gain", [1e-40, 1e9])
def test_a_gain_that_no_header_can_hold_is_rejected(gain):
    data, _ = make_stream()

    with pytest.raises(EncodeError, match="gain"):
        recolor_stream(data, Recoloring(gain=gain))


def test_offsets_beyond_the_range_of_codes_are_rejected():
    data, _ = make_stream()

    with pytest.raises(EncodeError):
        recolor_stream(data, Recoloring(offset=(1e5, 0, 0)))


def test_a_damaged_stream_is_rejected():
    data, _ = make_stream()

    with pytest.raises(BitstreamError):
        recolor_stream(data[:-30], Recoloring(gain=2.0))
