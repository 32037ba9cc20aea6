import socket
from urllib.parse import urlsplit

import numpy as np
import pytest

from tests.small_streams import CAMERA

pytest.importorskip("viser")

import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from quarc_ref.viewing.doorkeeper import is_host_name
from quarc_ref.viewing.page import Page, Program
from quarc_ref.viewing.vantage import find_up

_PROGRAM = Program(
    "toy.quarc", range(2), (np.zeros(0), np.zeros(0)), {}, find_up((CAMERA,), up_axis=0)
)
_NAME = "viewer.example"


@pytest.fixture(scope="module")
def page():
    with Page(_PROGRAM, ("127.0.0.1", 8780), (_NAME,)) as page:
        yield page


@pytest.fixture(scope="module")
def key(page):
    return urlsplit(page.url).query


@pytest.fixture(scope="module")
def port(page):
    return urlsplit(page.url).port


def _ask(port, path, *headers, address="127.0.0.1"):
    """Status and head of the answer to a request that says just this."""
    lines = [f"GET {path} HTTP/1.1", *headers, "Connection: close", "", ""]
    with socket.create_connection((address, port), timeout=30) as client:
        client.sendall("\r\n".join(lines).encode("latin-1"))
        answer = b"".join(iter(lambda: client.recv(1 << 16), b""))
    head = answer.partition(b"\r\n\r\n")[0].decode()
    return int(head.split()[1]), head


def _find_cookie(head):
    lines = [line for line in head.splitlines() if line.lower().startswith("set-cookie: ")]
    assert len(lines) == 1
    assert "HttpOnly; SameSite=Strict" in lines[0]
    return lines[0].partition(": ")[2].partition(";")[0]


def _open(port, cookie=None, host=None, origin=None, query=""):
    """Begin a websocket as the page does; a refusal is the status of the answer."""
    headers = {"Cookie": cookie} if cookie else {}
    url = f"ws://{host or f'127.0.0.1:{port}'}/{query}"
    with socket.create_connection(("127.0.0.1", port), timeout=30) as client:
        try:
            with connect(
                url,
                sock=client,
                origin=origin,
                additional_headers=headers,
                subprotocols=[f"viser-v{viser.__version__}"],
                compression=None,
            ) as opened:
                return len(opened.recv(timeout=30)) > 0
        except InvalidStatus as error:
            return error.response.status_code


def test_the_page_and_what_it_loads_are_given_to_who_has_its_address(port, key):
    status, head = _ask(port, f"/?{key}", f"Host: 127.0.0.1:{port}")
    cookie = f"Cookie: other=1; {_find_cookie(head)}"

    assert status == 200
    assert _ask(port, "/index.html", f"Host: localhost:{port}", cookie)[0] == 200
    assert _ask(port, "/nothing.js", f"Host: localhost:{port}", cookie)[0] == 404


def test_the_websocket_is_for_who_has_the_key(port, key):
    cookie = _find_cookie(_ask(port, f"/?{key}", f"Host: 127.0.0.1:{port}")[1])

    assert _open(port, cookie, origin=f"http://127.0.0.1:{port}") is True
    assert _open(port, cookie, f"localhost:{port}", f"http://localhost:{port}") is True
    assert _open(port, query=f"?{key}") is True
    assert _open(port, cookie=None) == 403
    assert _open(port, cookie=f"quarc-ref-{port}=no") == 403


@pytest.mark.parametrize(
    "headers",
    [
        ["Host: evil.example"],
        ["Host: evil.example:{port}"],
        ["Host: localhost.evil.example:{port}"],
        ["Host: localhost:{port}@evil.example"],
        ["Host: 127.0.0.1.evil.example"],
        ["Host: 192.0.2.1:{port}"],
        ["Host: "],
        ["Host: [::1"],
        [],
        ["Host: 127.0.0.1:{port}", "Host: evil.example"],
        ["Host: 127.0.0.1:{port}", "Origin: http://evil.example"],
        ["Host: 127.0.0.1:{port}", "Origin: http://127.0.0.1:{other}"],
        ["Host: 127.0.0.1:{port}", "Origin: http://127.0.0.1:{port}.evil.example"],
        ["Host: 127.0.0.1:{port}", "Origin: null"],
        ["Host: 127.0.0.1:{port}", "Origin: file://"],
        ["Host: 127.0.0.1:{port}", "Origin: http://127.0.0.1:{port}", "Origin: null"],
    ],
)
def test_a_foreign_host_or_origin_is_refused_even_with_the_key(headers, port, key):
    lines = [line.format(port=port, other=port + 1) for line in headers]
    status, head = _ask(port, f"/?{key}", *lines)

    assert status == 403
    assert "Set-Cookie" not in head


@pytest.mark.parametrize(
    ("host", "origin"),
    [
        (None, "http://evil.example"),
        (None, "null"),
        ("evil.example", "http://evil.example"),
        ("evil.example", None),
    ],
)
def test_a_websocket_of_another_site_is_refused_even_with_the_key(host, origin, port, key):
    assert _open(port, host=host, origin=origin, query=f"?{key}") == 403


@pytest.mark.parametrize(
    ("host", "origin"),
    [
        (_NAME, f"https://{_NAME}"),
        (f"{_NAME.upper()}:8443", f"https://{_NAME.upper()}:8443"),
        ("127.0.0.1:{port}", f"https://{_NAME}"),
        ("localhost:9000", "http://localhost:9000"),
    ],
)
def test_proxies_and_tunnels_are_let_in_under_names_that_were_given(host, origin, port, key):
    headers = f"Host: {host.format(port=port)}", f"Origin: {origin}"

    assert _ask(port, f"/?{key}", *headers)[0] == 200


@pytest.mark.parametrize(
    "path", ["/", "/index.html", "/?key=", "/?key=%ff", "/?key=no&key=", "//["]
)
def test_without_the_key_nothing_is_given(path, port):
    status, head = _ask(port, path, f"Host: 127.0.0.1:{port}")

    assert status == 403
    assert "Set-Cookie" not in head


def test_every_page_has_a_key_of_its_own(page):
    with Page(_PROGRAM, ("127.0.0.1", 8780)) as other:
        assert urlsplit(other.url).query != urlsplit(page.url).query
        status, _ = _ask(
            urlsplit(other.url).port,
            f"/?{urlsplit(other.url).query}",
            f"Host: {_NAME}",
        )

    assert status == 403


def test_a_page_for_other_machines_answers_to_the_address_that_was_asked():
    with Page(_PROGRAM, ("0.0.0.0", 8780)) as page:
        there = urlsplit(page.url)
        asked = [
            _ask(there.port, f"/?{there.query}", f"Host: {host}", address="127.0.0.2")[0]
            for host in ("127.0.0.2", f"0.0.0.0:{there.port}", "192.0.2.1")
        ]

    assert asked == [200, 200, 403]


def test_what_is_no_request_is_not_reported(page, port, capfd):
    with socket.create_connection(("127.0.0.1", port), timeout=30) as client:
        client.sendall(b"\x00 no request\r\n\r\n")
        client.recv(1 << 10)

    assert capfd.readouterr() == ("", "")
    assert not page.has_viewers


def test_the_page_is_never_shared_over_another_server(page):
    assert page._server.request_share_url() is None


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("viewer.example", True),
        ("Box", True),
        ("fe80::1", True),
        ("10.0.0.7", True),
        ("https://viewer.example", False),
        ("viewer.example:80", False),
        ("viewer.example/", False),
        ("", False),
    ],
)
def test_names_of_hosts_have_neither_scheme_nor_port(text, expected):
    assert is_host_name(text) is expected
