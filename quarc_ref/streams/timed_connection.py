"""HTTP connections with one deadline for the whole exchange.

In the standard library, the timeout applies to each read, so a slow server can delay an
exchange indefinitely. Here, one timeout covers name lookup, connection, tunnel, handshake
and all reads together.
"""

import socket
import ssl
import time
from concurrent.futures import Future
from http.client import HTTPConnection, HTTPSConnection
from threading import Thread
from typing import Any


class Deadline:
    """The time at which an operation times out.

    Args:
        seconds: Seconds from now to the deadline.
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

    def recv_into(self, *args: Any, **kwargs: Any) -> int:  # noqa: ANN401
        self.settimeout(self.deadline.remaining())
        return super().recv_into(*args, **kwargs)


class _TimedTlsSocket(_TimedSocket, ssl.SSLSocket):
    pass


class TimedConnection(HTTPConnection):
    """A connection without TLS."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:  # noqa: ANN401
        super().__init__(*args, **kwargs)
        self._deadline = Deadline(self.timeout or 0)
        self._create_connection = self._open_socket  # replaces the function of the standard library

    def connect(self) -> None:
        """Connect, through a tunnel if one is configured."""
        super().connect()
        self.sock.settimeout(self._deadline.remaining())  # for request and handshake

    def _open_socket(self, address: tuple[str, int], *_: object) -> _TimedSocket:
        """Connect to the first of the host's addresses that responds."""
        last_error = OSError("the host has no address")
        for family, kind, protocol, _, socket_address in _look_up(address, self._deadline):
            timed_socket = _TimedSocket(family, kind, protocol)
            timed_socket.deadline = self._deadline
            try:
                timed_socket.settimeout(self._deadline.remaining())
                timed_socket.connect(socket_address)
            except OSError as error:
                timed_socket.close()
                last_error = error
            else:
                return timed_socket
        raise last_error


class TimedTlsConnection(HTTPSConnection, TimedConnection):
    """A TLS connection, which needs a TLS context from `make_tls_context`."""

    sock: _TimedTlsSocket

    def connect(self) -> None:
        """Connect, then perform the TLS handshake."""
        super().connect()
        self.sock.deadline = self._deadline


def make_tls_context() -> ssl.SSLContext:
    """Make a TLS context that verifies servers with the system's certificates."""
    context = ssl.create_default_context()
    context.set_alpn_protocols(["http/1.1"])
    context.sslsocket_class = _TimedTlsSocket
    return context


def _look_up(address: tuple[str, int], deadline: Deadline) -> list[Any]:
    """Call `getaddrinfo` in a thread, which is abandoned at the deadline."""
    future: Future[list[Any]] = Future()

    def look_up() -> None:
        try:
            future.set_result(socket.getaddrinfo(*address, type=socket.SOCK_STREAM))
        except Exception as error:  # including a UnicodeError, which some host names cause
            future.set_exception(error)

    Thread(target=look_up, daemon=True).start()
    return future.result(deadline.remaining())
