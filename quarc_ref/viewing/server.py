"""A local web server for a page and its files, which supports range requests."""

import errno
import os
import socket
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socketserver import TCPServer
from typing import Any, ClassVar
from urllib.parse import unquote, urlsplit

from quarc_ref.format.errors import SourceError
from quarc_ref.streams.source import Source
from quarc_ref.viewing.ranges import parse_range
from quarc_ref.viewing.request_filter import RequestFilter
from quarc_ref.viewing.shared_source import GrowingSource

_PORT_COUNT = 100
_LAST_PORT = 65535
_UNAVAILABLE_PORT_ERRNOS = (errno.EADDRINUSE, errno.EACCES)
# hosts that stand for all addresses, each with the address for a browser on this machine
_BROWSER_ADDRESSES = {"": "127.0.0.1", "0.0.0.0": "127.0.0.1", "::": "::1"}
_BLOCK_BYTES = 1 << 20
_COMMON_HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",  # the URL contains the token
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


@dataclass(frozen=True, slots=True)
class Resource:
    """A resource that a browser can load.

    Attributes:
        media_type: Value of the Content-Type header.
        source: Thread-safe source of the resource's bytes, with a known size.
    """

    media_type: str
    source: Source


class Server(ThreadingHTTPServer):
    """Serves resources at `http://HOST:PORT/TOKEN/NAME`.

    Args:
        address: Host and port. If the port is in use, the next 99 ports are tried.
        resources: Resources by name; the page has the name `""`.
        extra_names: Additional host names of the server.
        report: Function that is called with a message when a resource cannot be read.

    Raises:
        OSError: The host is not an address of this machine, or no port is free.
    """

    # On other systems, this option would allow two servers to share a port.
    allow_reuse_address = os.name == "posix"
    # With Python's 5, connections of several browsers that open the page at once wait for seconds.
    request_queue_size = 128

    def __init__(
        self,
        address: tuple[str, int],
        resources: Mapping[str, Resource],
        extra_names: Collection[str] = (),
        report: Callable[[str], object] = lambda _: None,
    ) -> None:
        host, port = address
        self.resources, self.report = resources, report
        self.request_filter = RequestFilter(host, extra_names)
        self._host = _BROWSER_ADDRESSES.get(host, host)
        ports = range(port, min(port + _PORT_COUNT, _LAST_PORT + 1))
        try:
            self._bind_first_free_port(host, ports)
        except (OSError, UnicodeError) as error:  # UnicodeError: invalid host name
            cause = getattr(error, "strerror", None) or str(error)
            if getattr(error, "errno", None) in _UNAVAILABLE_PORT_ERRNOS:
                cause += f" (ports {ports.start} to {ports[-1]})"
            message = f"cannot listen on {host}: {cause}"
            raise OSError(message) from error

    @property
    def url(self) -> str:
        """URL of the page, for a browser on this machine."""
        return self.build_url(self._host)

    def build_url(self, host: str) -> str:
        """Return the URL of the page for a host name or address."""
        authority = f"[{host}]" if ":" in host else host
        return f"http://{authority}:{self.server_address[1]}/{self.request_filter.token}/"

    def server_bind(self) -> None:
        """Bind the socket without the slow lookup of the machine's name."""
        TCPServer.server_bind(self)

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401
        """Ignore errors that clients cause, such as closed connections."""

    def _bind_first_free_port(self, host: str, ports: range) -> None:
        """Listen on the first free port."""
        addresses = socket.getaddrinfo(
            host or None, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )
        self.address_family, _, _, _, (name, _, *scope) = addresses[0]
        for port in ports:
            try:
                super().__init__((name, port, *scope), _Handler)  # type: ignore[arg-type]
            except OSError as error:
                if port == ports[-1] or error.errno not in _UNAVAILABLE_PORT_ERRNOS:
                    raise
            else:
                return


class _Handler(BaseHTTPRequestHandler):
    """Handles GET and HEAD requests."""

    server: Server
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "quarc-ref", ""
    timeout: ClassVar[float] = 60.0  # seconds until an idle connection is closed

    def do_GET(self) -> None:
        """Send a resource or a requested range of its bytes."""
        self._respond(has_body=True)

    def do_HEAD(self) -> None:
        """Send only the headers of a resource."""
        self._respond(has_body=False)

    def log_message(self, format: str, *arguments: object) -> None:  # noqa: A002, inherited name
        """Suppress the request log."""

    def _respond(self, *, has_body: bool) -> None:
        hosts, origins = (self.headers.get_all(name, []) for name in ("Host", "Origin"))
        address = self.connection.getsockname()[0]
        reason = self.server.request_filter.find_rejection_reason(
            self.path, hosts, origins, address
        )
        if reason is not None:
            self._reject(HTTPStatus.FORBIDDEN, reason)
            return
        path, query = urlsplit(self.path)[2:4]
        _, slash, name = path.removeprefix("/").partition("/")
        if not slash:
            self._redirect(f"{path}/?{query}" if query else f"{path}/")
            return
        resource = self.server.resources.get(unquote(name))
        if resource is None:
            self._reject(HTTPStatus.NOT_FOUND, "the server has no resource at this address")
            return
        try:
            self._send(resource, has_body=has_body)
        except SourceError as error:
            self.server.report(str(error))
            self.close_connection = True  # the browser detects the incomplete response

    def _redirect(self, location: str) -> None:
        """Redirect to the page, whose relative URLs need the slash after the token."""
        self.send_response(HTTPStatus.PERMANENT_REDIRECT)
        self.send_header("Location", location)
        self.send_header("Content-Length", "0")
        for name, value in _COMMON_HEADERS.items():
            self.send_header(name, value)
        self.end_headers()

    def _send(self, resource: Resource, *, has_body: bool) -> None:
        source, range_header = resource.source, self.headers.get("Range")
        if isinstance(source, GrowingSource):
            _wait_for_range(source, range_header)
        size = source.size() or 0
        requested_range = parse_range(range_header, size)
        if requested_range is not None and not requested_range:
            self._send_headers(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, resource, 0)
            self.send_header("Content-Range", f"bytes */{size}")
            self.end_headers()
            return
        sent_range = range(size) if requested_range is None else requested_range
        self._send_headers(
            HTTPStatus.OK if requested_range is None else HTTPStatus.PARTIAL_CONTENT,
            resource,
            len(sent_range),
        )
        if requested_range is not None:
            self.send_header(
                "Content-Range", f"bytes {requested_range.start}-{requested_range.stop - 1}/{size}"
            )
        self.end_headers()
        if has_body:
            self._send_bytes(source, sent_range)

    def _send_bytes(self, source: Source, sent_range: range) -> None:
        for offset in range(sent_range.start, sent_range.stop, _BLOCK_BYTES):
            length = min(_BLOCK_BYTES, sent_range.stop - offset)
            block = source.read(offset, length)
            self.wfile.write(block)
            if len(block) < length:
                message = "the stream became shorter during the transfer"
                raise SourceError(message)

    def _send_headers(self, status: HTTPStatus, resource: Resource, length: int) -> None:
        self.send_response(status)
        self.send_header("Content-Type", resource.media_type)
        self.send_header("Content-Length", str(length))
        self.send_header("Accept-Ranges", "bytes")
        for name, value in _COMMON_HEADERS.items():
            self.send_header(name, value)

    def _reject(self, status: HTTPStatus, reason: str) -> None:
        body = f"Rejected: {reason}.\n".encode()
        self.send_response(status)
        self.send_header("Content-Type", "text/plain; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.command != "HEAD":
            with suppress(OSError):
                self.wfile.write(body)


def _wait_for_range(source: GrowingSource, range_header: str | None) -> None:
    """Wait for the first requested byte if a growing stream does not contain it yet."""
    size = source.size() or 0
    requested_range = parse_range(range_header, size)
    if requested_range is not None and not requested_range:
        source.wait_for_data(size)
