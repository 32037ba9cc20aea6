import pytest

from quarc_ref.viewing.request_filter import RequestFilter, is_host_name

_NAME = "viewer.example"
_ADDRESS = "127.0.0.1"


@pytest.fixture
def request_filter():
    return RequestFilter(_ADDRESS, (_NAME,))


def _is_accepted(request_filter, *headers, path=None, address=_ADDRESS):
    """Return whether a request with headers of the form `Name: value` is accepted."""
    pairs = [header.partition(": ") for header in headers]
    hosts, origins = (
        [value for name, _, value in pairs if name == header_name]
        for header_name in ("Host", "Origin")
    )
    path = f"/{request_filter.token}/" if path is None else path
    return request_filter.find_rejection_reason(path, hosts, origins, address) is None


@pytest.mark.parametrize(
    "headers",
    [
        ["Host: 127.0.0.1:8080"],
        ["Host: localhost:8080"],
        ["Host: LOCALHOST"],
        ["Host: [::1]:8080"],
        ["Host: 127.0.0.1:8080", "Origin: http://127.0.0.1:8080"],
    ],
)
def test_the_page_itself_is_allowed(headers, request_filter):
    assert _is_accepted(request_filter, *headers)


@pytest.mark.parametrize(
    "headers",
    [
        ["Host: evil.example"],
        ["Host: evil.example:8080"],
        ["Host: localhost.evil.example:8080"],
        ["Host: localhost:8080@evil.example"],
        ["Host: 127.0.0.1.evil.example"],
        ["Host: 192.0.2.1:8080"],
        ["Host: "],
        ["Host: [::1"],
        [],
        ["Host: 127.0.0.1:8080", "Host: evil.example"],
        ["Host: 127.0.0.1:8080", "Origin: http://evil.example"],
        ["Host: 127.0.0.1:8080", "Origin: http://127.0.0.1:8081"],
        ["Host: 127.0.0.1:8080", "Origin: http://127.0.0.1:8080.evil.example"],
        ["Host: 127.0.0.1:8080", "Origin: null"],
        ["Host: 127.0.0.1:8080", "Origin: file://"],
        ["Host: 127.0.0.1:8080", "Origin: http://127.0.0.1:8080", "Origin: null"],
    ],
)
def test_a_foreign_host_or_origin_is_rejected_even_with_the_token(headers, request_filter):
    assert not _is_accepted(request_filter, *headers)


@pytest.mark.parametrize(
    ("host", "origin"),
    [
        (_NAME, f"https://{_NAME}"),
        (f"{_NAME.upper()}:8443", f"https://{_NAME.upper()}:8443"),
        ("127.0.0.1:8080", f"https://{_NAME}"),
        ("localhost:9000", "http://localhost:9000"),
    ],
)
def test_proxies_and_tunnels_are_allowed_under_configured_names(host, origin, request_filter):
    assert _is_accepted(request_filter, f"Host: {host}", f"Origin: {origin}")


@pytest.mark.parametrize(
    "path", ["", "/", "/no/", "//", "/index.html", "/é/", "/{token}x/", "/x/{token}/"]
)
def test_without_the_token_nothing_is_allowed(path, request_filter):
    path = path.format(token=request_filter.token)
    assert not _is_accepted(request_filter, "Host: 127.0.0.1", path=path)


def test_every_server_has_its_own_token(request_filter):
    other_filter = RequestFilter(_ADDRESS)

    assert not _is_accepted(other_filter, "Host: 127.0.0.1", path=f"/{request_filter.token}/")
    assert not _is_accepted(other_filter, f"Host: {_NAME}")


def test_the_address_of_a_request_is_an_allowed_host():
    everywhere = RequestFilter("0.0.0.0")

    assert _is_accepted(everywhere, "Host: 10.0.0.7:8080", address="10.0.0.7")
    assert not _is_accepted(everywhere, "Host: 10.0.0.8:8080", address="10.0.0.7")


def test_ipv4_clients_of_an_ipv6_server_are_allowed_by_address():
    everywhere = RequestFilter("::")

    assert _is_accepted(everywhere, "Host: 10.0.0.7:8080", address="::ffff:10.0.0.7")
    assert not _is_accepted(everywhere, "Host: 10.0.0.8:8080", address="::ffff:10.0.0.7")
    assert _is_accepted(everywhere, "Host: [fd00::7]:8080", address="fd00::7")


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
