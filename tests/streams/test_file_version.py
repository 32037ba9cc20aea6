"""A file on a server that grows, changes or is replaced while it is read."""

import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.format.errors import SourceError
from quarc_ref.streams import Follow, decode
from quarc_ref.streams.file_version import Change, FileVersion
from quarc_ref.streams.http_source import HttpSource
from tests.streams.hostile_servers import DATA, OTHER_DATA, STATES, serve

_FIRST_VERSION = FileVersion(100, '"one"', "Monday")
_LONGER_DATA = bytes(5) + DATA
_DIGESTS = [compute_digest(state.scene) for state in STATES]
_HEADERS = {
    "ETag": lambda data: f'ETag: "{hash(data)}"\n',
    "time": lambda data: f'ETag: W/"same"\nLast-Modified: {hash(data)}\n',
    "size": lambda _: "",
}


@pytest.mark.parametrize(
    ("later", "change"),
    [
        (_FIRST_VERSION, Change.NONE),
        (FileVersion(100, '"one"', "Tuesday"), Change.NONE),
        (FileVersion(100, '"two"', "Monday"), Change.REPLACED),
        (FileVersion(100, None, "Tuesday"), Change.REPLACED),
        (FileVersion(100, None, "Monday"), Change.NONE),
        (FileVersion(), Change.NONE),
        (FileVersion(None, '"two"'), Change.GROWN),
        (FileVersion(99, '"one"', "Monday"), Change.REPLACED),
        (FileVersion(101, '"one"', "Monday"), Change.GROWN),
        (FileVersion(101, '"two"', "Tuesday"), Change.GROWN),
    ],
)
def test_a_file_is_identified_by_tag_or_time_and_by_size(later, change):
    assert _FIRST_VERSION.compare(later) is change
    assert FileVersion().compare(later) is Change.NONE


def test_values_missing_from_a_later_response_are_kept():
    assert _FIRST_VERSION.merged_with(FileVersion(100)) == _FIRST_VERSION
    assert FileVersion(None, '"one"').merged_with(FileVersion(100)) == FileVersion(100, '"one"')
    assert _FIRST_VERSION.merged_with(FileVersion(None, '"two"')) == FileVersion(
        100, '"two"', "Monday"
    )


@pytest.mark.parametrize(
    "later", [FileVersion(101), FileVersion(101, '"two"'), FileVersion(101, None, "Tuesday")]
)
def test_tag_and_time_of_another_size_are_not_kept(later):
    assert _FIRST_VERSION.merged_with(later) == later


@pytest.fixture(params=_HEADERS)
def server(request):
    """Return a server that serves `file(request)` and sends an ETag, a time, or only a size."""

    def answer(file_request):
        data = server.file(file_request)
        file_request.answer(data, _HEADERS[request.param](data))

    with serve(answer) as server:
        server.file, server.header_kind = lambda _: DATA, request.param
        yield server


def test_a_growing_stream_is_followed_for_any_response_headers(server):
    server.file = lambda request: DATA[: 20 * request.number]
    scenes = decode(HttpSource(server.url), follow=Follow(interval=0, patience=20))

    assert [compute_digest(scene) for scene in scenes] == _DIGESTS


@pytest.mark.parametrize("data", [OTHER_DATA, _LONGER_DATA, DATA[:-100], b""])
def test_a_file_replaced_during_reading_is_rejected(server, data):
    source = HttpSource(server.url)
    assert source.read(100, 200) == DATA[100:300]
    server.file = lambda _: data
    if server.header_kind == "size" and len(data) == len(DATA):
        assert source.read(300, 200) == data[300:500]  # cannot be distinguished from the first file
        return
    with pytest.raises(SourceError, match="it was changed while it was being read"):
        source.read(300, 200)


def test_a_file_replaced_after_a_request_of_its_size_is_rejected(server):
    source = HttpSource(server.url)
    source.read(100, 200)
    source.size()  # reads a byte that both files have
    server.file = lambda _: DATA[:8] + _LONGER_DATA
    with pytest.raises(SourceError, match="it was changed while it was being read"):
        source.read(300, 200)


def test_a_growing_file_is_not_another_file(server):
    source = HttpSource(server.url)
    for size in (0, 5, 40, len(DATA)):
        server.file = lambda _, size=size: DATA[:size]
        assert source.read(0, 100) == DATA[: min(size, 100)]
        assert source.size() == size


def test_a_file_that_grew_after_a_read_beyond_its_end_is_not_another_file(server):
    source = HttpSource(server.url)
    server.file = lambda _: DATA[:40]
    assert source.read(0, 100) == DATA[:40]
    server.file = lambda _: DATA[:60]
    assert source.read(60, 10) == b""  # the server sends only the new size

    assert source.read(30, 100) == DATA[30:60]
