import http.client
import socket
import threading
from contextlib import ExitStack, closing, contextmanager
from urllib.parse import urlsplit

import pytest

from quarc_ref.format.errors import SourceError
from quarc_ref.streams import BytesSource
from quarc_ref.viewing import server as server_module
from quarc_ref.viewing.server import Resource, Server
from quarc_ref.viewing.shared_source import GrowingSource, SharedSource

_HOST = "127.0.0.1"
_STREAM = bytes(range(256)) * 9000  # more bytes than a single read returns


class GrowingBytes:
    """A source to which another process appends bytes."""

    def __init__(self):
        self.data = b"first"

    def read(self, offset, length):
        return self.data[offset : offset + length]

    def size(self):
        return len(self.data)


class FailingSource:
    """A source whose server is no longer reachable."""

    def read(self, *_):
        message = "the server of the stream has gone"
        raise SourceError(message)

    def size(self):
        return 100


@contextmanager
def _run_server(*arguments, **options):
    with Server(*arguments, **options) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture(scope="module")
def growing():
    return GrowingBytes()


@pytest.fixture(scope="module")
def reports():
    return []


@pytest.fixture(scope="module")
def server(growing, reports):
    resources = {
        "": Resource("text/html; charset=utf-8", BytesSource(b"<page>")),
        "stream.quarc": Resource("application/octet-stream", SharedSource(BytesSource(_STREAM))),
        "live.quarc": Resource(
            "application/octet-stream", GrowingSource(growing, max_wait_seconds=0.3)
        ),
        "gone.quarc": Resource("application/octet-stream", FailingSource()),
    }
    with _run_server((_HOST, 20_100), resources, report=reports.append) as server:
        yield server


@pytest.fixture
def client(server):
    with closing(http.client.HTTPConnection(_HOST, server.server_address[1], timeout=30)) as client:
        yield client


def _request(client, server, name, method="GET", **headers):
    """Send a request; return status, headers and body of the response."""
    client.request(method, urlsplit(server.url).path + name, headers=headers)
    response = client.getresponse()
    return response.status, response.headers, response.read()


def test_the_page_is_served_at_the_root(client, server):
    status, headers, body = _request(client, server, "")

    assert (status, body) == (200, b"<page>")
    assert headers["Content-Type"] == "text/html; charset=utf-8"
    assert headers["Referrer-Policy"] == "no-referrer"


def test_a_query_does_not_change_what_is_served(client, server):
    assert _request(client, server, "?camera=cam03&loop")[2] == b"<page>"


@pytest.mark.parametrize("query", ["", "?frame=9"])
def test_a_url_without_the_last_slash_is_redirected(query, client, server):
    path = urlsplit(server.url).path.removesuffix("/")
    client.request("GET", f"{path}{query}")
    response = client.getresponse()

    assert (response.status, response.read()) == (308, b"")
    assert response.headers["Location"] == f"{path}/{query}"


def test_a_whole_stream_is_served_with_accept_ranges(client, server):
    status, headers, body = _request(client, server, "stream.quarc")

    assert (status, body) == (200, _STREAM)
    assert headers["Accept-Ranges"] == "bytes"


def test_a_range_is_served_with_its_position(client, server):
    range_header = {"Range": f"bytes=1000-{len(_STREAM) - 2}"}
    status, headers, body = _request(client, server, "stream.quarc", **range_header)

    assert (status, body) == (206, _STREAM[1000:-1])
    assert headers["Content-Range"] == f"bytes 1000-{len(_STREAM) - 2}/{len(_STREAM)}"


def test_a_range_beyond_the_end_is_rejected_with_the_size(client, server):
    status, headers, body = _request(client, server, "stream.quarc", Range=f"bytes={len(_STREAM)}-")

    assert (status, body) == (416, b"")
    assert headers["Content-Range"] == f"bytes */{len(_STREAM)}"


def test_one_connection_serves_many_requests(client, server):
    for _ in range(3):
        assert _request(client, server, "stream.quarc", "HEAD")[:1] == (200,)
        assert _request(client, server, "nothing")[:1] == (404,)
        assert _request(client, server, "stream.quarc", Range="bytes=5-6")[2] == b"\5\6"


@pytest.mark.parametrize("path", ["/", "/index.html", "/no/stream.quarc", "/%00/"])
def test_without_the_token_nothing_is_served(path, client):
    client.request("GET", path)
    response = client.getresponse()

    assert response.status == 403
    assert b"token" in response.read()


@pytest.mark.parametrize("headers", [{"Host": "evil.example"}, {"Origin": "http://evil.example"}])
def test_cross_site_requests_are_rejected(headers, client, server):
    assert _request(client, server, "stream.quarc", **headers)[0] == 403


def test_other_paths_are_not_found(client, server):
    assert _request(client, server, "../stream.quarc")[0] == 404
    assert _request(client, server, "%2e%2e/stream.quarc")[0] == 404


def test_bytes_that_arrive_during_a_wait_are_served(client, server, growing):
    growing.data = b"first"
    timer = threading.Timer(0.05, lambda: setattr(growing, "data", b"first, and more"))
    timer.start()
    status, headers, body = _request(client, server, "live.quarc", Range="bytes=5-")

    assert (status, body) == (206, b", and more")
    assert headers["Content-Range"] == "bytes 5-14/15"


def test_waiting_for_a_stream_that_does_not_grow_ends(client, server, growing):
    growing.data = b"first"

    assert _request(client, server, "live.quarc", Range="bytes=5-")[0] == 416


def test_an_unreadable_stream_is_reported_and_the_response_truncated(client, server, reports):
    with pytest.raises(http.client.IncompleteRead):
        _request(client, server, "gone.quarc")

    assert reports == ["the server of the stream has gone"]


def test_an_invalid_request_is_not_reported(server, reports, capfd):
    report_count = len(reports)
    with socket.create_connection((_HOST, server.server_address[1]), timeout=30) as connection:
        connection.sendall(b"\x00 no request\r\n\r\n")
        connection.recv(1 << 10)

    assert capfd.readouterr() == ("", "")
    assert len(reports) == report_count


def test_a_server_on_all_interfaces_is_reachable_on_this_machine():
    with _run_server(
        ("0.0.0.0", 20_100), {"": Resource("text/plain", BytesSource(b"here"))}
    ) as server:
        address = urlsplit(server.url)
        with closing(http.client.HTTPConnection("127.0.0.2", address.port, timeout=30)) as client:
            statuses = [
                _request(client, server, "", Host=host)[0]
                for host in ("127.0.0.2", f"0.0.0.0:{address.port}", "192.0.2.1")
            ]

    assert address.hostname == "127.0.0.1"
    assert statuses == [200, 200, 403]


def test_a_server_on_all_interfaces_of_version_6_is_reachable_by_version_4():
    resources = {"": Resource("text/plain", BytesSource(b"here"))}
    with ExitStack() as stack:
        try:
            server = stack.enter_context(_run_server(("::", 20_100), resources))
            port = server.server_address[1]
            stack.enter_context(socket.create_connection(("127.0.0.2", port), timeout=30))
        except OSError:
            pytest.skip("this machine has no IPv6, or its sockets for IPv6 exclude IPv4")
        client = http.client.HTTPConnection("127.0.0.2", port, timeout=30)
        stack.enter_context(closing(client))

        assert _request(client, server, "")[0] == 200


def test_an_address_of_version_6_is_written_in_brackets():
    try:
        server = Server(("::1", 20_100), {})
    except OSError:
        pytest.skip("this machine has no IPv6")
    with server:
        assert server.url.startswith("http://[::1]:")


def _occupy_port(port=0):
    listener = socket.create_server((_HOST, port))
    return closing(listener), listener.getsockname()[1]


def _occupy_two_ports(stack):
    """Occupy two consecutive ports; return the first port."""
    while True:
        with ExitStack() as attempt:
            listener, port = _occupy_port()
            attempt.enter_context(listener)
            try:
                attempt.enter_context(_occupy_port(port + 1)[0])
            except (OSError, OverflowError):
                continue
            stack.push(attempt.pop_all())
            return port


def test_many_connections_are_made_even_before_the_server_accepts_one():
    with Server((_HOST, 0), {}) as server, ExitStack() as stack:
        for _ in range(32):
            stack.enter_context(socket.create_connection(server.server_address[:2], timeout=1))


def test_if_a_port_is_in_use_one_of_the_next_is_chosen():
    with ExitStack() as stack:
        port = _occupy_two_ports(stack)
        server = stack.enter_context(Server((_HOST, port), {}))

        assert port + 2 <= server.server_address[1] < port + 100


@pytest.mark.parametrize("limit", ["_PORT_COUNT", "_LAST_PORT"])
def test_only_a_few_ports_are_tried(limit, monkeypatch):
    with ExitStack() as stack:
        port = _occupy_two_ports(stack)
        monkeypatch.setattr(server_module, limit, 2 if limit == "_PORT_COUNT" else port + 1)
        expected_message = rf"^cannot listen on 127.0.0.1: .* \(ports {port} to {port + 1}\)$"

        with pytest.raises(OSError, match=expected_message):
            Server((_HOST, port), {})


@pytest.mark.parametrize("host", ["300.1.1.1", "192.0.2.1", "nosuchhost.invalid", "a..b", "x" * 70])
def test_an_invalid_host_is_named(host):
    with pytest.raises(OSError, match=rf"^cannot listen on {host}: \S+") as raised:
        Server((host, 8080), {})

    assert "ports" not in str(raised.value)
