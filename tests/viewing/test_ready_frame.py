import pytest

from quarc_ref.decoder import dequantize
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.playback import Frame
from quarc_ref.streams import BytesSource
from quarc_ref.viewing.outline import outline_stream
from quarc_ref.viewing.ready_frame import Preparer, describe_frame
from tests.small_streams import make_stream


@pytest.fixture(scope="module")
def stream():
    return make_stream(frame_count=5, canonical_every=3)


@pytest.fixture(scope="module")
def ready(stream):
    data, states = stream
    source = BytesSource(data)
    prepare = Preparer(source, outline_stream(source), 1.0)
    return [prepare(Frame(state, dequantize(state.scene), 0, 12_000_000)) for state in states]


def test_sizes_are_those_of_inspection(stream, ready):
    for frame, told in zip(ready, inspect_stream(stream[0]).frames, strict=True):
        assert (frame.frame, frame.canonical) == (told.frame, told.canonical)
        assert frame.sizes.items() >= told.coded_bytes.items()
        assert frame.sizes["total"] == told.chunk_bytes
        assert frame.sizes["overhead"] == told.chunk_bytes - sum(told.coded_bytes.values())


def test_what_is_told_is_what_is_there(ready):
    first, second = (describe_frame(frame, None, 30.0) for frame in ready[:2])

    assert "| frame | 0, canonical |" in first
    assert f"| canonical | {ready[0].sizes['canonical']:,} bytes |" in first
    assert "motion" not in first
    assert "| frame | 1, moved |" in second
    assert f"| motion | {ready[1].sizes['motion']:,} bytes |" in second
    assert f"| Gaussians | {ready[1].splats.count} |" in second
    assert "| decoded in | 12 ms |" in second
    assert "paused" in second


def test_the_rate_stands_beside_the_pace(ready):
    assert "| sent | 29.4 per second, of 30 |" in describe_frame(ready[1], 29.43, 30.0)


def test_memory_is_that_of_what_is_drawn(ready):
    assert ready[0].nbytes == ready[0].splats.nbytes > 0
