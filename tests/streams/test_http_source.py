import errno
import os
import threading
import time

import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.format.errors import SourceError, TruncatedError
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams import Follow, decode, open_source, recover
from quarc_ref.streams.http_source import HttpSource
from tests.small_streams import make_stream
from tests.streams.hostile_servers import serve, serve_data

_DATA, _STATES = make_stream(gaussian_count=12, frame_count=12, canonical_every=4)
_DIGESTS = [compute_digest(state.scene) for state in _STATES]


def test_a_stream_on_a_server_decodes_as_in_memory():
    with serve_data(_DATA) as server, open_source(server.url) as source:
        assert source.size() == len(_DATA)
        assert [compute_digest(scene) for scene in decode(source)] == _DIGESTS


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("my str\u00f8m.quarc", "/my%20str%C3%B8m.quarc"),
        ("my%20str%C3%B8m.quarc?a=1&b=\u00e9#c", "/my%20str%C3%B8m.quarc?a=1&b=%C3%A9"),
    ],
)
def test_characters_that_a_url_does_not_allow_are_escaped(name, path):
    with serve_data(_DATA) as server:
        assert HttpSource(server.url.replace("stream", name)).read(0, 4) == _DATA[:4]
    assert [head.split(" ")[1] for head in server.request_heads] == [path]


def test_a_range_of_frames_takes_less_than_half_of_the_bytes():
    lengths = []

    def answer(request):
        lengths.append(request.last + 1 - request.first)
        request.answer(_DATA)

    with serve(answer) as server:
        (scene,) = decode(HttpSource(server.url), 8, 9)

    assert compute_digest(scene) == _DIGESTS[8]
    assert sum(lengths) < len(_DATA) / 2


def test_only_a_read_at_the_end_is_short():
    with serve_data(_DATA) as server:
        source = HttpSource(server.url)
        assert source.read(len(_DATA) - 3, 10) == _DATA[-3:]
        assert source.read(len(_DATA), 10) == b""
        assert source.read(1 << 62, 10) == b""
        assert source.read(5, 0) == b""


def test_a_truncated_stream_on_a_server_is_rejected_as_truncated():
    with serve_data(_DATA[:-1]) as server:
        with pytest.raises(TruncatedError):
            list(decode(HttpSource(server.url)))
        assert list(recover(HttpSource(server.url)))[-1].reject_id == "truncated"


def test_a_growing_stream_on_a_server_can_be_followed():
    versions = [_DATA[:500]]
    with serve(lambda request: request.answer(versions[-1])) as server:
        scenes = decode(HttpSource(server.url), follow=Follow(interval=0.01, patience=20))
        timer = threading.Timer(0.1, versions.append, [_DATA])
        timer.start()
        assert [compute_digest(scene) for scene in scenes] == _DIGESTS
        timer.join()


def test_an_empty_stream_has_a_size():
    with serve_data(b"") as server:
        assert HttpSource(server.url).size() == 0


def _send_range(request, first, end, size):
    body = _DATA[first:end]
    headers = f"Content-Range: bytes {first}-{first + len(body) - 1}/{size}\n"
    headers += f"Content-Length: {len(body)}\n\n"
    request.send(f"HTTP/1.1 206 Partial Content\n{headers}", body)


def test_a_server_without_a_content_length_is_read():
    def answer(request):
        if request.first < len(_DATA):
            _send_range(request, request.first, request.last + 1, "*")
        else:
            request.send("HTTP/1.1 416 Range Not Satisfiable\nContent-Length: 0\n\n")

    with serve(answer) as server:
        source = HttpSource(server.url)
        assert source.size() is None
        assert [compute_digest(scene) for scene in decode(source, 6)] == _DIGESTS[6:]


def _send_fewer_bytes(request):
    _send_range(request, request.first, request.last, len(_DATA))


def _send_more_bytes(request):
    _send_range(request, request.first, request.last + 2, "*")


def _omit_range(request):
    request.send("HTTP/1.1 206 Partial Content\nContent-Length: 8\n\n", _DATA[:8])


def _answer_not_found(request):
    request.send("HTTP/1.1 404 Not Found\nContent-Length: 0\n\n")


def _send_garbage(request):
    request.send("this is no HTTP\n\n")


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (_send_fewer_bytes, "sends bytes 0 to 6 where 0 to 7 were requested"),
        (_send_more_bytes, "sends bytes 0 to 8 where 0 to 7 were requested"),
        (_omit_range, "does not state which bytes"),
        (_answer_not_found, "answers 404"),
        (_send_garbage, "cannot be read"),
    ],
)
def test_a_server_with_another_response_is_named(answer, message):
    with serve(answer) as server:
        with pytest.raises(SourceError, match=message) as caught:
            list(decode(HttpSource(server.url, patience=0)))
        assert server.url in str(caught.value)
        assert len(server.request_heads) == 1


def _stall_at_once(request):
    request.stop_event.wait(10)


def _stall_in_the_body(request):
    body = request.send_head(_DATA, "Content-Length: 40\n\n")
    request.send("", body[:1])
    request.stop_event.wait(10)


@pytest.mark.parametrize("answer", [_stall_at_once, _stall_in_the_body])
def test_a_stalling_server_times_out(answer):
    with serve(answer) as server:
        start_time = time.monotonic()
        with pytest.raises(SourceError, match=r"takes more than 0\.2 seconds"):
            HttpSource(server.url, timeout=0.2, patience=0).read(0, 40)
        assert time.monotonic() - start_time < 5


@pytest.mark.parametrize(
    "url", ["http://127.0.0.1:1/x", "http://", "http://[", "ftp://127.0.0.1/x", "file:///etc/x"]
)
def test_an_unreachable_server_is_a_source_error(url):
    with pytest.raises(SourceError):
        HttpSource(url, timeout=1, patience=0).read(0, 8)


def test_the_message_of_an_unreachable_server_has_only_the_reason():
    with pytest.raises(SourceError) as caught:
        HttpSource("http://127.0.0.1:1/x", timeout=5, patience=0).read(0, 8)

    expected_message = "the server of http://127.0.0.1:1/x cannot be read: "
    assert str(caught.value) == expected_message + os.strerror(errno.ECONNREFUSED)


@pytest.mark.parametrize("frame", [3, 4, 6, 8, 11])
def test_frames_at_and_after_a_snapshot_are_read_by_ranges(frame):
    header = StreamHeader(snapshots=True, gaussians_per_anchor=4)
    data, states = make_stream(header, 40, 12, snapshot_every=4)

    with serve_data(data) as server, open_source(server.url) as source:
        scene = next(iter(decode(source, frame, frame + 1)))

    assert compute_digest(scene) == compute_digest(states[frame].scene)
