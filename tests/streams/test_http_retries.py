"""Requests that fail temporarily are repeated; the clock of these tests advances only in pauses."""

import errno
import itertools
import socket
import ssl
import struct
from types import SimpleNamespace
from urllib.error import URLError

import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.format.errors import SourceError
from quarc_ref.streams import Follow, decode, http_source, open_source
from quarc_ref.streams.http_source import HttpSource
from tests.streams.hostile_servers import STATES, close_early, serve

_DIGESTS = [compute_digest(state.scene) for state in STATES]


@pytest.fixture(autouse=True)
def pauses(monkeypatch):
    """A list of all pauses in seconds."""
    seconds = []
    clock = SimpleNamespace(monotonic=lambda: sum(seconds), sleep=seconds.append)
    monkeypatch.setattr(http_source, "time", clock)
    return seconds


def _reset(request):
    request.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    request.connection.close()


def _make_status(status):
    return lambda request: request.send(f"HTTP/1.1 {status} No\nContent-Length: 0\n\n")


_TEMPORARY_FAULTS = {
    "reset": _reset,
    "close": lambda request: request.connection.close(),
    "half": close_early,
    **{str(status): _make_status(status) for status in (408, 425, 429, 500, 502, 503, 504)},
}


@pytest.mark.parametrize("name", _TEMPORARY_FAULTS)
def test_a_server_that_fails_now_and_then_is_read(name, pauses):
    def answer(request):
        request.answer() if request.number % 4 else _TEMPORARY_FAULTS[name](request)

    with serve(answer) as server:
        assert [compute_digest(scene) for scene in decode(HttpSource(server.url))] == _DIGESTS
    assert len(pauses) > 4


@pytest.mark.parametrize("patience", [0, 1.5, 60])
def test_a_request_is_repeated_until_patience_is_over(patience, pauses):
    with serve(_make_status(503)) as server:
        with pytest.raises(SourceError, match="answers 503 No"):
            HttpSource(server.url, patience=patience).read(0, 8)

        assert len(server.request_heads) == len(pauses) + 1
    assert patience - 3.2 < sum(pauses) <= patience
    assert all(first <= second <= 3.2 for first, second in itertools.pairwise(pauses))


@pytest.mark.parametrize("status", [200, 400, 401, 403, 404, 410])
def test_a_request_that_the_server_rejects_is_not_repeated(status):
    with serve(_make_status(status)) as server:
        with pytest.raises(SourceError):
            HttpSource(server.url, patience=60).read(0, 8)

        assert len(server.request_heads) == 1


@pytest.mark.parametrize(
    ("error", "is_repeated"),
    [
        (ConnectionRefusedError(), True),
        (TimeoutError(), True),
        (ssl.SSLEOFError(), True),
        (OSError(errno.ENETUNREACH, "unreachable"), True),
        (socket.gaierror(socket.EAI_AGAIN, "later"), True),
        (socket.gaierror(socket.EAI_NONAME, "unknown"), False),
        (ssl.SSLCertVerificationError(), False),
        (OSError("Tunnel connection failed: 403"), False),
    ],
)
def test_only_errors_that_may_pass_are_repeated(error, is_repeated, pauses, monkeypatch):
    def fail(*_):
        raise URLError(error)

    source = HttpSource("http://example.org/stream", patience=60)
    monkeypatch.setattr(source._client, "get", fail)
    with pytest.raises(SourceError):
        source.size()

    assert bool(pauses) == is_repeated


@pytest.mark.parametrize("failures", [5, 100])
def test_a_follower_repeats_requests_for_its_patience(failures):
    def answer(request):
        _reset(request) if 6 <= request.number < 6 + failures else request.answer()

    with serve(answer) as server:
        with open_source(server.url, Follow(patience=600)) as source:
            assert [compute_digest(scene) for scene in decode(source)] == _DIGESTS
        server.request_heads.clear()
        with open_source(server.url) as source, pytest.raises(SourceError):
            list(decode(source))
