import io
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.format import container, wire
from quarc_ref.format.errors import BitstreamError
from quarc_ref.streams import BytesSource, PipeSource
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.stream_writer import StreamWriter
from quarc_ref.viewing.outline import (
    CameraChoiceError,
    compute_scaled_height,
    find_camera,
    outline_stream,
    read_cameras,
    resize_camera,
)
from tests.small_streams import CAMERA, CountedSource, make_stream, rebuild_stream

OTHER_CAMERA = replace(CAMERA, name="cam01", held_out=False)


@pytest.fixture(scope="module")
def data():
    return make_stream(frame_count=5, canonical_every=3)[0]


def test_the_frames_are_those_of_the_stream(data):
    outline = outline_stream(BytesSource(data))

    assert outline.cameras == (CAMERA,)
    assert outline.header == make_stream()[1][0].scene.header
    kinds = [chunk.kind for chunk in outline.chunk_headers]
    assert kinds == [b"CANO", b"FRAM", b"FRAM", b"CANO", b"FRAM"]
    assert (outline.first_frame, outline.stop) == (0, 5)


@pytest.mark.parametrize(
    ("start", "stop", "count"), [(0, None, 5), (2, None, 3), (0, 2, 2), (4, 9, 1), (5, 9, 0)]
)
def test_frames_of_a_range_are_counted(start, stop, count, data):
    assert outline_stream(BytesSource(data)).count_frames(start, stop) == count


def test_a_part_of_a_stream_keeps_its_ordinals(data):
    chunks = [chunk for chunk in split_chunks(data) if chunk.kind != container.INDX]
    head, came = chunks[0], chunks[1]
    later = [chunk for chunk in chunks[2:] if chunk.kind != container.TAIL][-2:]
    part = rebuild_stream((chunk.kind, chunk.payload) for chunk in (head, came, *later))
    outline = outline_stream(BytesSource(part))

    assert (outline.first_frame, outline.stop) == (3, 5)
    assert outline.count_frames(0, 4) == 1


def test_the_last_cameras_chunk_is_used(data):
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(data)]
    chunks.insert(3, (container.CAME, wire.build_cameras((OTHER_CAMERA,))))

    assert outline_stream(BytesSource(rebuild_stream(chunks))).cameras == (OTHER_CAMERA,)


def test_the_last_metadata_chunk_is_used(data):
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(data)]
    for value in ("1 0 0", "0 1 0"):
        chunks.insert(-2, (container.META, wire.build_metadata({"up": value})))

    assert outline_stream(BytesSource(rebuild_stream(chunks))).metadata == {"up": "0 1 0"}


def test_payloads_of_frames_are_not_read(data):
    source = CountedSource(data)
    outline = outline_stream(source)

    payload_bytes = sum(chunk.length for chunk in outline.chunk_headers)
    assert source.byte_count() < len(data) - payload_bytes / 2


def test_a_truncated_stream_has_the_frames_before(data):
    complete = outline_stream(BytesSource(data))
    truncated = outline_stream(BytesSource(data[: complete.chunk_headers[-1].end - 1]))

    assert truncated.chunk_headers == complete.chunk_headers[:4]
    assert truncated.cameras == (CAMERA,)


def test_every_complete_frame_of_a_truncated_stream_counts(data):
    frames = outline_stream(BytesSource(data)).chunk_headers

    for size in range(frames[0].offset, len(data)):
        outline = outline_stream(BytesSource(data[:size]))
        assert outline.chunk_headers == tuple(frame for frame in frames if frame.end <= size)


class _SizeCountingSource(BytesSource):
    """A stream that counts requests for its size."""

    size_requests = 0

    def size(self):
        self.size_requests += 1
        return super().size()


def test_the_size_is_not_requested_for_every_frame(data):
    source = _SizeCountingSource(data)

    assert len(outline_stream(source).chunk_headers) == 5
    assert source.size_requests == 1


def test_a_file_that_is_not_a_stream_is_rejected():
    with pytest.raises(BitstreamError, match="bad-magic"):
        outline_stream(BytesSource(b"no stream at all"))


def test_a_pipe_can_be_outlined_too(data, tmp_path):
    (tmp_path / "a.quarc").write_bytes(data)
    with (tmp_path / "a.quarc").open("rb") as pipe:
        assert outline_stream(PipeSource(pipe)) == outline_stream(BytesSource(data))


def test_a_camera_is_found_by_name_and_the_first_is_the_default():
    assert find_camera([CAMERA, OTHER_CAMERA], "cam01") == OTHER_CAMERA
    assert find_camera([CAMERA, OTHER_CAMERA], None) == CAMERA


def test_an_unknown_camera_is_rejected_with_the_known_ones():
    with pytest.raises(CameraChoiceError, match="cam02; its cameras are cam00, cam01"):
        find_camera([CAMERA, OTHER_CAMERA], "cam02")
    with pytest.raises(CameraChoiceError, match="no cameras"):
        find_camera([], None)


def test_the_height_follows_from_the_width():
    assert compute_scaled_height(CAMERA, 1) == 1
    assert compute_scaled_height(CAMERA, 10**400) == 3 * 10**400 // 4


@pytest.mark.parametrize("width", [1, 33, 64, 200])
def test_a_resized_camera_sees_the_same(width):
    resized = resize_camera(CAMERA, width)

    assert resized.width == width
    for direction in np.random.default_rng(2).uniform(-1, 1, (5, 2)):
        x, y = CAMERA.fx * direction[0] + CAMERA.cx, CAMERA.fy * direction[1] + CAMERA.cy
        u, v = resized.fx * direction[0] + resized.cx, resized.fy * direction[1] + resized.cy
        assert u / resized.width == pytest.approx(x / CAMERA.width)
        assert v / resized.height == pytest.approx(y / CAMERA.height)


def test_cameras_are_read_without_decoding_a_frame(data):
    source = CountedSource(data)
    first = outline_stream(BytesSource(data)).chunk_headers[0]

    assert read_cameras(source) == (CAMERA,)
    assert source.byte_count() < first.payload_offset + 8


def test_a_stream_without_frames_has_no_cameras(data):
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(data)][:1]
    writer = io.BytesIO()
    StreamWriter(writer, chunks[0][1]).finish()

    assert read_cameras(BytesSource(writer.getvalue())) is None


def test_a_stream_damaged_at_the_start_has_no_cameras(data):
    with pytest.raises(BitstreamError):
        read_cameras(BytesSource(data[:60] + bytes([data[60] ^ 1]) + data[61:]))
