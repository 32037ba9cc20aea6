import numpy as np
import pytest

from quarc_ref.decoder import dequantize
from quarc_ref.streams import decode
from tests.small_streams import make_stream

fourdgs = pytest.importorskip("fourdgs")
pytest.importorskip("zstandard")
keyframe_deltas = pytest.importorskip("rate.keyframe_deltas")


@pytest.fixture(scope="module")
def data():
    return make_stream(gaussian_count=60, frame_count=5)[0]


def test_the_written_frames_are_those_of_the_stream(data, monkeypatch):
    from fourdgs import keyframe_delta_file

    write_sequence, written_files = keyframe_delta_file.write_sequence, []
    monkeypatch.setattr(
        keyframe_delta_file,
        "write_sequence",
        lambda *arguments, **options: (
            written_files.append(write_sequence(*arguments, **options)) or b""
        ),
    )
    keyframe_deltas.measure_file_sizes(decode(data))

    assert len(written_files) == 4
    for file in written_files[1::2]:
        decoded = keyframe_delta_file.decode_streamed(file)
        assert len(decoded.chunks) == 5
        for chunk, scene in zip(decoded.chunks, decode(data), strict=True):
            order = np.argsort(chunk.state.ids)
            bins = chunk.state.bins[fourdgs.opcode.A_POSITION][order]
            step, origin = decoded.quantization.step_pos, decoded.quantization.pos_origin
            position_errors = np.abs(bins * step + origin - dequantize(scene).positions)
            assert np.array_equal(chunk.state.ids[order], scene.ids)
            assert position_errors.max() <= 0.51 * step + 1e-6


def test_the_settings_with_the_fewest_bytes_are_chosen(data):
    best_sizes, default_sizes = keyframe_deltas.measure_file_sizes(decode(data))

    assert best_sizes.settings != default_sizes.settings
    assert best_sizes.total < default_sizes.total
    assert best_sizes.first < default_sizes.first


def test_a_stream_of_one_frame_costs_what_its_first_frame_costs():
    for sizes in keyframe_deltas.measure_file_sizes(decode(make_stream(frame_count=1)[0])):
        assert sizes.total == sizes.first > 0
