"""Tests of streams from pipes for verbs that read a stream more than once."""

import io
import subprocess
import tempfile
import time
import tracemalloc

import pytest

from quarc_ref.cli.seekable_stream import growing_copy, open_seekable
from quarc_ref.format.constants import LEVELS
from quarc_ref.format.container import build_chunk
from quarc_ref.format.errors import SourceError
from quarc_ref.streams import BytesSource, PipeSource
from quarc_ref.streams.chunk_reader import split_chunks
from tests.cli.processes import COMMAND
from tests.small_streams import make_stream

_DATA, _ = make_stream(gaussian_count=12, frame_count=4, canonical_every=2)
_CHUNKS = list(split_chunks(_DATA))
_MAX_KIBIBYTES = 4 << 20
_MAX_CHUNK_BYTES = LEVELS[10].chunk_bytes


class _EndlessInput(io.RawIOBase):
    """Given bytes followed by endless zeros; counts the bytes that have been read."""

    def __init__(self, data=b""):
        self.data, self.count = data, 0

    def readable(self):
        return True

    def read(self, size=-1):
        assert 0 <= size <= 1 << 20
        data = self.data[self.count : self.count + size].ljust(size, b"\0")
        self.count += size
        return data


def test_seekable_sources_are_used_directly():
    source = BytesSource(_DATA)
    with open_seekable(source) as seekable:
        assert seekable is source


@pytest.mark.parametrize("size", [0, 5, 30, _CHUNKS[2].offset + 7, len(_DATA) - 1, len(_DATA)])
def test_a_pipe_is_buffered_as_far_as_it_is_intact(size):
    with open_seekable(PipeSource(io.BytesIO(_DATA[:size]))) as seekable:
        assert seekable.size() == size
        assert seekable.read(0, len(_DATA)) == _DATA[:size]
        assert seekable.read(3, 5) == _DATA[:size][3:8]


def test_a_chunk_with_a_damaged_payload_is_buffered_with_what_follows():
    data = bytearray(_DATA)
    data[_CHUNKS[3].offset + 25] ^= 1
    with open_seekable(PipeSource(io.BytesIO(data))) as seekable:
        assert seekable.read(0, len(_DATA)) == bytes(data)


@pytest.mark.parametrize("size", [0, 8, _CHUNKS[3].offset, len(_DATA)])
def test_data_that_is_not_a_stream_is_not_buffered(size):
    pipe = _EndlessInput(_DATA[:size])
    with open_seekable(PipeSource(pipe)) as seekable:
        assert size < seekable.size() < size + 100
        assert seekable.read(0, size) == _DATA[:size]
    assert pipe.count < size + 100


def test_a_long_stream_is_buffered_in_little_memory():
    data = _DATA[: _CHUNKS[1].offset] + build_chunk(b"oDds", 1, bytes(_MAX_CHUNK_BYTES))
    pipe = PipeSource(io.BytesIO(data), buffer_bytes=0)
    tracemalloc.start()
    with open_seekable(pipe) as seekable:
        assert seekable.size() == len(data)
    assert tracemalloc.get_traced_memory()[1] < _MAX_CHUNK_BYTES / 2
    tracemalloc.stop()


def test_a_full_disk_is_named(monkeypatch):
    class FullDisk(io.BytesIO):
        def write(self, _):
            raise OSError(28, "No space left on device")

    monkeypatch.setattr("quarc_ref.cli.seekable_stream.TemporaryFile", lambda **_: FullDisk())
    error = f"does not fit into {tempfile.gettempdir()}: No space left on device"
    with (
        pytest.raises(SourceError, match=error),
        open_seekable(PipeSource(io.BytesIO(_DATA))),
    ):
        pass


def test_a_closed_copy_returns_no_bytes():
    with growing_copy(PipeSource(io.BytesIO(_DATA))) as copy:
        while copy.size() < len(_DATA):
            time.sleep(0.01)
        assert copy.read(0, len(_DATA)) == _DATA

    assert copy.read(0, len(_DATA)) == b""


@pytest.mark.parametrize("verb", ["verify --deep", "render -o {out}", "view --no-open", "info"])
def test_endless_standard_input_that_is_not_a_stream_is_rejected_at_once(verb, tmp_path):
    arguments = verb.format(out=tmp_path / "out").split()
    limited_command = [
        "sh",
        "-c",
        f'ulimit -v {_MAX_KIBIBYTES}; exec "$@" </dev/zero',
        "sh",
        *COMMAND,
    ]
    completed = subprocess.run(
        [*limited_command, arguments[0], "-", *arguments[1:]],
        capture_output=True,
        timeout=60,
        check=False,
    )

    assert completed.returncode == 1
    assert b"the stream is rejected: bad-magic at byte 0" in completed.stderr
