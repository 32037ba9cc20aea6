import contextlib
import errno
import http.server
import os
import re
import threading
import time

import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.format.errors import SourceError, TruncatedError
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams import Follow, decode, open_source, recover
from quarc_ref.streams.http_source import HttpSource
from tests.small_streams import make_stream

_DATA, _STATES = make_stream(gaussian_count=12, frame_count=12, canonical_every=4)
_DIGESTS = [compute_digest(state.scene) for state in _STATES]


class _Server(http.server.ThreadingHTTPServer):
    """Serves ranges of a stream; `fault` is a function that sends a faulty response instead."""

    daemon_threads = True

    def __init__(self, data: bytes, fault=None) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.data, self.fault, self.ranges, self.paths = data, fault, [], []
        self.stop_event = threading.Event()
        self.url = f"http://127.0.0.1:{self.server_port}/stream.quarc"

    def handle_error(self, request, client_address):
        """Ignore errors: the clients of these tests close connections early."""


class _Handler(http.server.BaseHTTPRequestHandler):
    def log_message(self, *_):
        """Do not log."""

    def answer(self, status, body, **headers):
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        self.end_headers()
        with contextlib.suppress(OSError):
            self.wfile.write(body)

    def do_GET(self):
        self.server.paths.append(self.path)
        first, last = map(int, re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers["Range"]).groups())
        self.server.ranges.append((first, last))
        if self.server.fault:
            self.server.fault(self, first, last)
            return
        data = self.server.data
        if first >= len(data):
            self.answer(416, b"", Content_Range=f"bytes */{len(data)}", Content_Length="0")
            return
        body = data[first : last + 1]
        self.answer_range(first, body, str(len(data)))

    def answer_range(self, first, body, total):
        content_range = f"bytes {first}-{first + len(body) - 1}/{total}"
        self.answer(206, body, Content_Range=content_range, Content_Length=str(len(body)))


@contextlib.contextmanager
def _serve(data=_DATA, fault=None):
    server = _Server(data, fault)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield server
    finally:
        server.stop_event.set()
        server.shutdown()
        thread.join()
        server.server_close()


def test_a_stream_on_a_server_decodes_as_in_memory():
    with _serve() as server, open_source(server.url) as source:
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
    with _serve() as server:
        assert HttpSource(server.url.replace("stream.quarc", name)).read(0, 4) == _DATA[:4]
        assert server.paths == [path]


def test_a_range_of_frames_takes_less_than_half_of_the_bytes():
    with _serve() as server:
        (scene,) = decode(HttpSource(server.url), 8, 9)

        assert compute_digest(scene) == _DIGESTS[8]
        assert sum(last + 1 - first for first, last in server.ranges) < len(_DATA) / 2


def test_only_a_read_at_the_end_is_short():
    with _serve() as server:
        source = HttpSource(server.url)
        assert source.read(len(_DATA) - 3, 10) == _DATA[-3:]
        assert source.read(len(_DATA), 10) == b""
        assert source.read(1 << 62, 10) == b""
        assert source.read(5, 0) == b""


def test_a_truncated_stream_on_a_server_is_rejected_as_truncated():
    with _serve(_DATA[:-1]) as server:
        with pytest.raises(TruncatedError):
            list(decode(HttpSource(server.url)))
        assert list(recover(HttpSource(server.url)))[-1].reject_id == "truncated"


def test_a_growing_stream_on_a_server_can_be_followed():
    with _serve(_DATA[:500]) as server:
        scenes = decode(HttpSource(server.url), follow=Follow(interval=0.01, patience=20))
        timer = threading.Timer(0.1, lambda: setattr(server, "data", _DATA))
        timer.start()
        assert [compute_digest(scene) for scene in scenes] == _DIGESTS
        timer.join()


def test_an_empty_stream_has_a_size():
    with _serve(b"") as server:
        assert HttpSource(server.url).size() == 0


def test_a_server_without_a_content_length_is_read():
    def fault(handler, first, last):
        if first < len(_DATA):
            handler.answer_range(first, _DATA[first : last + 1], "*")
        else:
            handler.answer(416, b"", Content_Length="0")

    with _serve(fault=fault) as server:
        source = HttpSource(server.url)
        assert source.size() is None
        assert [compute_digest(scene) for scene in decode(source, 6)] == _DIGESTS[6:]


def _ignore_ranges(handler, _first, _last):
    handler.answer(200, _DATA, Content_Length=str(len(_DATA)))


def _answer_other_bytes(handler, first, last):
    handler.answer_range(first + 1, _DATA[first + 1 : last + 2], str(len(_DATA)))


def _answer_fewer_bytes(handler, first, last):
    handler.answer_range(first, _DATA[first:last], str(len(_DATA)))


def _answer_more_bytes(handler, first, last):
    handler.answer_range(first, _DATA[first : last + 2], "*")


def _omit_range(handler, first, last):
    handler.answer(206, _DATA[first : last + 1], Content_Length=str(last + 1 - first))


def _hang_up(handler, first, last):
    content_range = f"bytes {first}-{last}/{len(_DATA)}"
    handler.answer(206, b"x", Content_Range=content_range, Content_Length=str(last + 1 - first))


def _answer_not_found(handler, _first, _last):
    handler.answer(404, b"", Content_Length="0")


def _send_garbage(handler, _first, _last):
    handler.wfile.write(b"this is no HTTP\r\n\r\n")


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (_ignore_ranges, "does not support range requests"),
        (_answer_other_bytes, "sends bytes 1 to 8 where 0 to 7 were requested"),
        (_answer_fewer_bytes, "sends bytes 0 to 6 where 0 to 7 were requested"),
        (_answer_more_bytes, "sends bytes 0 to 8 where 0 to 7 were requested"),
        (_omit_range, "does not state which bytes"),
        (_hang_up, "stops after 1 of 8 bytes"),
        (_answer_not_found, "answers 404"),
        (_send_garbage, "cannot be read"),
    ],
)
def test_a_server_with_another_response_is_named(fault, message):
    with _serve(fault=fault) as server:
        with pytest.raises(SourceError, match=message) as caught:
            list(decode(HttpSource(server.url, patience=0)))
        assert server.url in str(caught.value)
        assert len(server.ranges) == 1


def _stall_at_once(handler, _first, _last):
    handler.server.stop_event.wait(10)


def _stall_in_the_body(handler, first, last):
    _stall_after(handler, first, last, b"x")


def _stall_after(handler, first, last, body_start):
    content_range = f"bytes {first}-{last}/{len(_DATA)}"
    handler.send_response(206)
    handler.send_header("Content-Range", content_range)
    handler.send_header("Content-Length", str(last + 1 - first))
    handler.end_headers()
    handler.wfile.write(body_start)
    handler.server.stop_event.wait(10)


def _send_slowly(handler, first, last):
    content_range = f"bytes {first}-{last}/{len(_DATA)}"
    handler.send_response(206)
    handler.send_header("Content-Range", content_range)
    handler.send_header("Content-Length", str(last + 1 - first))
    handler.end_headers()
    with contextlib.suppress(OSError):
        for byte in _DATA[first : last + 1]:
            handler.wfile.write(bytes([byte]))
            handler.server.stop_event.wait(0.1)


@pytest.mark.parametrize("fault", [_stall_at_once, _stall_in_the_body, _send_slowly])
def test_a_stalling_server_times_out(fault):
    with _serve(fault=fault) as server:
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

    with _serve(data) as server, open_source(server.url) as source:
        scene = next(iter(decode(source, frame, frame + 1)))

    assert compute_digest(scene) == compute_digest(states[frame].scene)
