"""Clients reject streams from faulty and hostile servers in time."""

import base64
import contextlib
import shutil
import socket
import ssl
import subprocess
import threading
import time
import tracemalloc

import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.format.errors import SourceError
from quarc_ref.streams import decode
from quarc_ref.streams.http_client import RedirectError, remove_credentials, resolve_redirect
from quarc_ref.streams.http_source import HttpSource
from tests.streams import hostile_servers
from tests.streams.hostile_servers import DATA, HOSTILE_RESPONDERS, STATES, redirect, serve

_TIMEOUT_S = 0.5
_TIMEOUT_MESSAGE = f"takes more than {_TIMEOUT_S} seconds to answer"
_GRACE_S = 20.0  # a busy machine is slow; without the limit, most of these never end
_MAX_MEMORY_BYTES = 64 << 20
_DIGESTS = [compute_digest(state.scene) for state in STATES]


def _read_rejected_stream(url, timeout=20.0):
    """Read a stream that is rejected within limits of time and memory; return the message."""
    tracemalloc.start()
    start_time = time.monotonic()
    try:
        with pytest.raises(SourceError) as caught:
            list(decode(HttpSource(url, timeout, patience=0)))
        assert time.monotonic() - start_time < timeout + _GRACE_S
        assert tracemalloc.get_traced_memory()[1] < _MAX_MEMORY_BYTES
    finally:
        tracemalloc.stop()
    return str(caught.value)


def _decode(url):
    return [compute_digest(scene) for scene in decode(HttpSource(url, timeout=20))]


@pytest.mark.parametrize("name", HOSTILE_RESPONDERS)
def test_reading_from_a_hostile_server_ends_in_time_with_a_message(name):
    answer, fault = HOSTILE_RESPONDERS[name]
    with serve(answer) as server:
        expected_message = _read_rejected_stream(server.url, _TIMEOUT_S)

    assert expected_message.startswith(f"the server of {server.url} ")
    assert fault in expected_message


@pytest.fixture(scope="module")
def certificate(tmp_path_factory):
    """Return the paths of a self-signed certificate for 127.0.0.1 and of its key."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed, so no certificate can be made")
    folder = tmp_path_factory.mktemp("certificate")
    certificate_files = folder / "certificate.pem", folder / "key.pem"
    request = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2"]
    names = ["-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1"]
    files = ["-out", str(certificate_files[0]), "-keyout", str(certificate_files[1])]
    subprocess.run([*request, *names, *files], check=True, capture_output=True)
    return certificate_files


@pytest.fixture
def tls(certificate, monkeypatch):
    """Return the TLS context of a server with a certificate that this process trusts."""
    monkeypatch.setenv("SSL_CERT_FILE", str(certificate[0]))
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(*certificate)
    return context


def test_a_stream_is_read_over_tls(tls):
    with serve(hostile_servers.Request.answer, tls) as server:
        assert _decode(server.url) == _DIGESTS


def test_a_redirect_out_of_tls_is_rejected(tls):
    with (
        serve(hostile_servers.Request.answer) as plain_server,
        serve(lambda request: redirect(request, plain_server.url), tls) as server,
    ):
        assert f"redirects from https to '{plain_server.url}'" in _read_rejected_stream(server.url)
        assert plain_server.request_heads == []


def test_an_untrusted_certificate_is_rejected(tls, monkeypatch):
    monkeypatch.delenv("SSL_CERT_FILE")
    with serve(hostile_servers.Request.answer, tls) as server:
        assert "certificate" in _read_rejected_stream(server.url)


def test_a_slow_body_times_out_over_tls_too(tls):
    with serve(hostile_servers.send_slowly, tls) as server:
        assert _TIMEOUT_MESSAGE in _read_rejected_stream(server.url, _TIMEOUT_S)


def test_a_slow_handshake_times_out():
    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=_send_handshake_slowly, args=(server,))
        thread.start()
        assert _TIMEOUT_MESSAGE in _read_rejected_stream(
            f"https://127.0.0.1:{server.getsockname()[1]}/", _TIMEOUT_S
        )
        thread.join()


def _send_handshake_slowly(server):
    connection, _ = server.accept()
    with connection, contextlib.suppress(OSError):
        connection.sendall(b"\x16\x03\x03\x40\x00")  # a record of 16384 bytes
        while not time.sleep(hostile_servers.PAUSE):
            connection.sendall(b"\x02")


def test_the_body_of_a_redirect_is_not_read():
    def answer(request):
        if request.path == "/stream":
            redirect(request, "there")
        request.answer()

    with serve(answer) as server:
        assert _decode(server.url) == _DIGESTS


def test_a_few_redirects_are_followed_and_more_are_not():
    def answer(request):
        number = int(request.path[1:].replace("stream", "0"))
        if number == server.last:
            request.answer()
        else:
            redirect(request, f"/{number + 1}")

    with serve(answer) as server:
        server.last = 5
        assert _decode(server.url) == _DIGESTS
        server.last = 6
        assert "redirects more than 5 times" in _read_rejected_stream(server.url)


def _add_credentials(url):
    return url.replace("//", "//me:p%40ss:w@")


def test_user_and_password_are_sent_as_basic_authentication():
    with serve(hostile_servers.Request.answer) as server:
        assert _decode(_add_credentials(server.url)) == _DIGESTS
        token = base64.b64encode(b"me:p@ss:w").decode()
        for head in server.request_heads:
            assert f"\r\nAuthorization: Basic {token}\r\n" in head
            assert f"\r\nHost: 127.0.0.1:{server.url.split(':')[2].split('/')[0]}\r\n" in head


@pytest.mark.parametrize("separator", ["//@", "//:@"])
def test_an_empty_user_and_password_are_not_sent(separator):
    with serve(hostile_servers.Request.answer) as server:
        assert _decode(server.url.replace("//", separator)) == _DIGESTS
        assert not any("Authorization" in head for head in server.request_heads)


def test_only_the_user_and_password_of_the_server_are_removed():
    def answer(request):
        paths.append(request.path)
        request.answer()

    paths, path = [], "/a@b?from=http://me:pass@example.org/x"
    with serve(answer) as server:
        base_url = server.url.removesuffix("/stream")
        assert _decode(f"{base_url}{path}") == _decode(f"{_add_credentials(base_url)}{path}")
    assert set(paths) == {path}
    assert remove_credentials(f"http://me:a@b@[::1]:80{path}") == f"http://[::1]:80{path}"


def test_user_and_password_are_not_sent_to_other_origins():
    with (
        serve(hostile_servers.Request.answer) as other_server,
        serve(lambda request: redirect(request, other_server.url)) as server,
    ):
        assert _decode(_add_credentials(server.url)) == _DIGESTS
        assert all("Authorization" in head for head in server.request_heads)
        assert not any("Authorization" in head for head in other_server.request_heads)


def test_user_and_password_are_not_in_messages():
    with serve(lambda request: request.send("HTTP/1.1 401 Unauthorized\n\n")) as server:
        message = _read_rejected_stream(_add_credentials(server.url))

    assert message == f"the server of {server.url} answers 401 Unauthorized"


def test_all_redirects_share_one_deadline():
    def answer(request):
        request.stop_event.wait(0.4 * _TIMEOUT_S)
        redirect(request, f"{request.path}x")

    with serve(answer) as server:
        assert _TIMEOUT_MESSAGE in _read_rejected_stream(server.url, _TIMEOUT_S)
    assert 2 <= len(server.request_heads) <= 3


@pytest.mark.parametrize(
    ("location", "target"),
    [
        ("there", "https://a.org/streams/there"),
        ("/there", "https://a.org/there"),
        ("//b.org/c", "https://b.org/c"),
        ("HTTPS://b.org/c?d=e#f", "https://b.org/c?d=e"),
        ("a b\xe9", "https://a.org/streams/a%20b%E9"),
    ],
)
def test_a_redirect_is_resolved_against_its_url(location, target):
    assert resolve_redirect("https://a.org/streams/here?x=y", location) == target
    assert resolve_redirect("http://a.org/", "https://b.org/") == "https://b.org/"


@pytest.mark.parametrize(
    "location",
    [None, "", "http://a.org/", "HTTP:there", "file:///etc/passwd", "ftp://a.org/", "data:,x"],
)
def test_a_redirect_to_no_server_or_out_of_tls_is_rejected(location):
    with pytest.raises(RedirectError):
        resolve_redirect("https://a.org/", location)


def test_a_chunked_response_with_the_requested_range_is_read():
    def answer(request):
        body = request.send_head(headers="Transfer-Encoding: chunked\n\n")
        for offset in range(0, len(body), 7):
            piece = body[offset : offset + 7]
            request.send(f"{len(piece):x};extension\n", piece)
            request.send("\n")
        request.send("0\nTrailer: x\n\n")

    with serve(answer) as server:
        source = HttpSource(server.url)
        assert source.read(3, 100) == DATA[3:103]
        assert source.size() == len(DATA)


@pytest.mark.parametrize("end", ["5\nabc", "0\n\n", ""])
def test_a_truncated_chunked_response_is_rejected(end):
    def answer(request):
        request.send_head(headers="Transfer-Encoding: chunked\n\n")
        request.send(f"3\nabc\n{end}")

    with serve(answer) as server:
        assert f"stops after {6 if 'abc' in end else 3} of 8 bytes" in _read_rejected_stream(
            server.url
        )


@pytest.mark.parametrize("length", ["Content-Length: 9\n", ""])
def test_a_body_longer_than_its_range_is_rejected(length):
    def answer(request):
        request.send("", request.send_head(headers=f"{length}\n"))
        request.send_endlessly(b"more")

    with serve(answer) as server:
        assert "sends more than the 8 bytes that were requested" in _read_rejected_stream(
            server.url
        )


def test_a_server_that_denies_existing_bytes_is_rejected():
    def answer(request):
        request.send(f"HTTP/1.1 416 No\nContent-Range: bytes */{len(DATA)}\n\n")

    with serve(answer) as server:
        assert f"does not send byte 0 of a file of {len(DATA)} bytes" in _read_rejected_stream(
            server.url
        )


def test_the_first_address_that_responds_is_used(monkeypatch):
    with socket.socket() as closed, serve(hostile_servers.Request.answer) as server:
        closed.bind(("127.0.0.1", 0))
        kind = (socket.AF_INET, socket.SOCK_STREAM, 0, "")
        addresses = [(*kind, closed.getsockname()), (*kind, server.server_address)]
        monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: addresses)
        assert _decode(server.url) == _DIGESTS


def test_a_name_lookup_times_out(monkeypatch):
    stop_event = threading.Event()
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: stop_event.wait(30))
    expected_message = _read_rejected_stream("http://example.org/stream", _TIMEOUT_S)
    stop_event.set()

    assert expected_message == f"the server of http://example.org/stream {_TIMEOUT_MESSAGE}"


@pytest.fixture
def set_proxy_for_all(monkeypatch):
    """Return a function that sets a proxy for all servers."""

    def set_proxy(url):
        for name in ("no_proxy", "NO_PROXY", "http_proxy", "https_proxy"):
            monkeypatch.delenv(name, raising=False)
            monkeypatch.delenv(name.upper(), raising=False)
        for name in ("http_proxy", "https_proxy"):
            monkeypatch.setenv(name, url)

    return set_proxy


def test_the_proxy_of_the_environment_is_used(set_proxy_for_all):
    with serve(hostile_servers.Request.answer) as proxy:
        set_proxy_for_all(proxy.url)
        assert _decode("http://example.org/stream") == _DIGESTS

    assert all(head.startswith("GET http://example.org/stream ") for head in proxy.request_heads)


def test_a_stream_is_read_over_tls_through_a_tunnel(set_proxy_for_all, tls):
    def answer(request):
        host, port = request.path.split(":")
        with socket.create_connection((host, int(port))) as upstream:
            request.send("HTTP/1.0 200 Connected\n\n")
            reply_thread = threading.Thread(target=_forward, args=(upstream, request.connection))
            reply_thread.start()
            _forward(request.connection, upstream)
            reply_thread.join()

    with serve(hostile_servers.Request.answer, tls) as server, serve(answer) as proxy:
        set_proxy_for_all(proxy.url)
        assert _decode(server.url) == _DIGESTS
    assert all(head.startswith("CONNECT 127.0.0.1:") for head in proxy.request_heads)


def _forward(source, sink):
    """Forward all data, and close the connection at its end."""
    while piece := source.recv(1 << 16):
        sink.sendall(piece)
    sink.shutdown(socket.SHUT_WR)


def test_a_slow_tunnel_times_out(set_proxy_for_all):
    def answer(request):
        request.send("HTTP/1.0 200 OK\nX: ")
        request.send_endlessly(b"x", hostile_servers.PAUSE)

    with serve(answer) as proxy:
        set_proxy_for_all(proxy.url)
        assert _TIMEOUT_MESSAGE in _read_rejected_stream("https://example.org/stream", _TIMEOUT_S)
