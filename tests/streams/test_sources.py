import io
import mmap
import os
import sys
import threading
import time
import types
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.decoder import compute_digest
from quarc_ref.format.constants import CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, LEVELS
from quarc_ref.format.errors import SourceError, TruncatedError
from quarc_ref.streams import BytesSource, FileSource, Follow, PipeSource, decode, open_source
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.resync import MAX_WINDOW_BYTES
from tests.small_streams import make_stream

_DATA, _STATES = make_stream(gaussian_count=12, frame_count=6, canonical_every=3)
_DIGESTS = [compute_digest(state.scene) for state in _STATES]
_BYTES = bytes(range(256)) * 3
_OFFSETS = st.integers(0, 1000)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("sources") / "bytes"
    path.write_bytes(_BYTES)
    return path


def test_a_stream_in_memory_is_any_bytes_like_object(tmp_path):
    (tmp_path / "a.quarc").write_bytes(_DATA)
    with (
        (tmp_path / "a.quarc").open("rb") as file,
        mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as mapped,
    ):
        for stream in (_DATA, bytearray(_DATA), memoryview(_DATA), mapped):
            assert [compute_digest(scene) for scene in decode(stream)] == _DIGESTS


@pytest.mark.parametrize(
    "stream", ["a.quarc", Path("a.quarc"), io.BytesIO(), np.frombuffer(_BYTES, np.uint8), None]
)
def test_what_is_neither_bytes_nor_a_source_is_named(stream):
    with pytest.raises(
        TypeError, match=f"not {type(stream).__name__}: open files with open_source"
    ):
        next(decode(stream))


def test_threads_can_read_from_the_same_file(path):
    class FileOfTwoThreads(io.FileIO):
        def seek(self, offset, whence=0):
            result = super().seek(offset, whence)
            if threading.current_thread() is not other:
                other.start()
                other.join(timeout=0.1)  # it waits until this read has ended
            return result

    with FileOfTwoThreads(path) as file:
        source, results = FileSource(file), []
        other = threading.Thread(target=lambda: results.append(source.read(500, 5)))
        assert source.read(3, 9) == _BYTES[3:12]
        other.join()
    assert results == [_BYTES[500:505]]


def test_a_path_is_opened_like_its_name(path):
    with open_source(path) as of_path, open_source(str(path)) as of_name:
        assert of_path.read(3, 9) == of_name.read(3, 9) == _BYTES[3:12]


@given(_OFFSETS, _OFFSETS)
def test_a_source_reads_like_a_slice(path, offset, length):
    expected = _BYTES[offset : offset + length]

    with path.open("rb") as file:
        assert FileSource(file).read(offset, length) == expected
    assert BytesSource(_BYTES).read(offset, length) == expected
    assert PipeSource(io.BytesIO(_BYTES)).read(offset, length) == expected


def test_the_size_is_returned_if_known(path):
    with open_source(str(path)) as source:
        assert source.size() == len(_BYTES)
    assert BytesSource(_BYTES).size() == len(_BYTES)
    assert PipeSource(io.BytesIO(_BYTES)).size() is None


def test_reading_far_beyond_the_end_of_a_file_returns_nothing(path):
    with open_source(str(path)) as source:
        assert source.read(1 << 63, 1 << 40) == b""
        assert source.read(len(_BYTES) - 1, 1 << 40) == _BYTES[-1:]


@given(st.lists(st.tuples(st.integers(0, 60), st.integers(0, 60)), max_size=30))
def test_a_pipe_can_go_back_as_far_as_its_buffer(steps):
    source, max_offset = PipeSource(io.BytesIO(_BYTES), buffer_bytes=60), 0
    for distance, length in steps:
        offset = max(0, max_offset - distance)
        assert source.read(offset, length) == _BYTES[offset : offset + length]
        max_offset = max(max_offset, min(offset + length, len(_BYTES)))


def test_going_back_beyond_the_buffer_of_a_pipe_is_an_error():
    source = PipeSource(io.BytesIO(bytes(1 << 20)), buffer_bytes=100)
    source.read((1 << 20) - 10, 10)

    assert len(source._buffer) <= 100 + (1 << 16)
    with pytest.raises(SourceError, match="back"):
        source.read(0, 1)


def test_recovery_can_go_back_to_the_header_of_the_longest_payload():
    class Zeros:
        def read(self, length):
            return bytes(length)

    source, limit = PipeSource(Zeros()), LEVELS[30].chunk_bytes
    start = 1 << 20
    source.read(start, MAX_WINDOW_BYTES)  # of a search, which finds a header and checks its payload
    end = start + CHUNK_HEADER_BYTES + limit + CHUNK_CRC_BYTES
    for offset in range(start + CHUNK_HEADER_BYTES, end, 1 << 20):
        source.read(offset, min(1 << 20, end - offset))

    assert source.read(start, MAX_WINDOW_BYTES) == bytes(MAX_WINDOW_BYTES)


def test_a_claimed_size_of_four_billion_bytes_is_not_allocated(path):
    with open_source(str(path)) as source:
        assert source.read(0, (1 << 32) - 1) == _BYTES
    assert PipeSource(io.BytesIO(_BYTES)).read(0, (1 << 32) - 1) == _BYTES


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such pipes")
def test_a_non_blocking_pipe_without_data_has_not_ended():
    read_end, write_end = os.pipe()
    os.set_blocking(read_end, False)
    writer = threading.Timer(0.2, lambda: (os.write(write_end, b"late"), os.close(write_end)))
    writer.start()
    with os.fdopen(read_end, "rb", buffering=0) as pipe:
        source = PipeSource(pipe)
        assert source.read(0, 10) == b"late"
    writer.join()


def test_a_closed_standard_input_is_an_error(monkeypatch):
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(SourceError, match="closed"), open_source("-"):
        pass


def test_standard_input_is_a_source(monkeypatch):
    monkeypatch.setattr(sys, "stdin", types.SimpleNamespace(buffer=io.BytesIO(_DATA)))

    with open_source("-") as source:
        assert [compute_digest(scene) for scene in decode(source)] == _DIGESTS


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes")
def test_a_named_pipe_is_a_source(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    writer = threading.Thread(target=path.write_bytes, args=(_DATA,))
    writer.start()

    with open_source(str(path)) as source:
        assert [compute_digest(scene) for scene in decode(source)] == _DIGESTS
    writer.join()


def test_a_file_read_in_small_pieces_is_read_completely(path):
    class Slow(io.FileIO):
        def read(self, size):
            return super().read(min(size, 7))

    with Slow(path) as file:
        assert FileSource(file).read(5, 500) == _BYTES[5:505]


def test_frames_are_decoded_from_a_pipe_before_it_ends():
    read_end, write_end = os.pipe()
    third_frame_offset = next(chunk.offset for chunk in list(split_chunks(_DATA))[5:])
    os.write(write_end, _DATA[:third_frame_offset])
    with os.fdopen(read_end, "rb") as pipe:
        scenes = decode(PipeSource(pipe))
        assert compute_digest(next(scenes)) == _DIGESTS[0]
        assert compute_digest(next(scenes)) == _DIGESTS[1]
        os.write(write_end, _DATA[third_frame_offset:])
        os.close(write_end)
        assert [compute_digest(scene) for scene in scenes] == _DIGESTS[2:]


def test_a_file_can_be_played_while_it_grows(tmp_path):
    path, is_first_decoded = tmp_path / "growing", threading.Event()
    path.write_bytes(b"")
    third_frame = [chunk for chunk in split_chunks(_DATA) if chunk.kind in (b"CANO", b"FRAM")][2]

    def write():
        with path.open("ab", buffering=0) as file:
            for offset in range(0, len(_DATA), 150):
                if offset > third_frame.offset:
                    assert is_first_decoded.wait(30)
                file.write(_DATA[offset : offset + 150])
                time.sleep(0.001)

    writer = threading.Thread(target=write)
    writer.start()
    with open_source(str(path)) as source:
        scenes = decode(source, follow=Follow(interval=0.002, patience=30))
        first = next(scenes)
        is_first_decoded.set()
        digests = [compute_digest(scene) for scene in (first, *scenes)]
    writer.join()

    assert digests == _DIGESTS


def test_seeking_works_in_a_growing_file(tmp_path):
    path = tmp_path / "growing"
    fifth_frame = [chunk for chunk in split_chunks(_DATA) if chunk.kind in (b"CANO", b"FRAM")][4]
    path.write_bytes(_DATA[: fifth_frame.offset + 30])

    with open_source(str(path)) as source:
        scenes = decode(source, 3, follow=Follow(interval=0.002, patience=30))
        digests = [compute_digest(next(scenes))]
        path.write_bytes(_DATA)
        digests += [compute_digest(scene) for scene in scenes]

    assert digests == _DIGESTS[3:]


def test_a_file_that_stops_growing_is_truncated(tmp_path):
    path = tmp_path / "cut"
    path.write_bytes(_DATA[:-1])
    start_time = time.monotonic()
    with open_source(str(path)) as source, pytest.raises(TruncatedError):
        list(decode(source, follow=Follow(interval=0.01, patience=0.1)))

    assert time.monotonic() - start_time >= 0.1
