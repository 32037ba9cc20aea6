"""HTTP connections with one deadline for the whole exchange.

In the standard library, the timeout applies to each read, so a slow server can delay an
exchange indefinitely. Here name lookup, connection, tunnel, handshake and all reads share
one timeout.
"""

import socket
import ssl
import time
from concurrent.futures import Future
from http.client import HTTPConnection, HTTPSConnection
from threading import Thread
from typing import Any


class Deadline:
    """A point in time that ends an operation.

    Args:
        seconds: Seconds from now.
    """

    def __init__(self, seconds: float) -> None:
        self._end = time.monotonic() + seconds

    def remaining(self) -> float:
        """Return the remaining seconds.

        Raises:
            TimeoutError: No time is left.
        """
        remaining = self._end - time.monotonic()
        if remaining <= 0:
            message = "timed out"
            raise TimeoutError(message)
        return remaining


class _TimedSocket(socket.socket):
    """A socket whose reads fail after a deadline."""

    deadline: Deadline

    def recv_into(self, *given: Any, **named: Any) -> int:  # noqa: ANN401
        self.settimeout(self.deadline.remaining())
        return super().recv_into(*given, **named)


class _TimedTlsSocket(_TimedSocket, ssl.SSLSocket):
    pass


class TimedConnection(HTTPConnection):
    """A connection without TLS."""

    def __init__(self, *given: Any, **named: Any) -> None:  # noqa: ANN401
        super().__init__(*given, **named)
        self._deadline = Deadline(self.timeout or 0)
        self._create_connection = self._open_socket  # replaces the one of the standard library

    def connect(self) -> None:
        """Connect, through a tunnel if one is configured."""
        super().connect()
        self.sock.settimeout(self._deadline.remaining())  # for request and handshake

    def _open_socket(self, address: tuple[str, int], *_: object) -> _TimedSocket:
        """Connect to the first address of the host that responds."""
        failure = OSError("the host has no address")
        for family, kind, protocol, _, place in _look_up(address, self._deadline):
            opened = _TimedSocket(family, kind, protocol)
            opened.deadline = self._deadline
            try:
                opened.settimeout(self._deadline.remaining())
                opened.connect(place)
            except OSError as error:
                opened.close()
                failure = error
            else:
                return opened
        raise failure


class TimedTlsConnection(HTTPSConnection, TimedConnection):
    """A connection with TLS, with a context from `make_tls_context`."""

    sock: _TimedTlsSocket

    def connect(self) -> None:
        """Connect, then perform the TLS handshake."""
        super().connect()
        self.sock.deadline = self._deadline


def make_tls_context() -> ssl.SSLContext:
    """Make a TLS context that verifies servers by the system's certificates."""
    context = ssl.create_default_context()
    context.set_alpn_protocols(["http/1.1"])
    context.sslsocket_class = _TimedTlsSocket
    return context


def _look_up(address: tuple[str, int], deadline: Deadline) -> list[Any]:
    """Call `getaddrinfo` with a deadline, after which its thread is abandoned."""
    found: Future[list[Any]] = Future()

    def look_up() -> None:
        try:
            found.set_result(socket.getaddrinfo(*address, type=socket.SOCK_STREAM))
        except Exception as error:  # including a UnicodeError, which some names cause
            found.set_exception(error)

    Thread(target=look_up, daemon=True).start()
    return found.result(deadline.remaining())
