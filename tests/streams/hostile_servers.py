"""Faulty and hostile HTTP servers, each a function that answers one request.

The functions use plain sockets, because the servers of the standard library follow HTTP.
"""

import contextlib
import re
import socket
import socketserver
import ssl
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from quarc_ref.format import container, wire
from quarc_ref.streams.chunk_reader import split_chunks
from tests.small_streams import make_stream, rebuild_stream

PAUSE = 0.05
DATA, STATES = make_stream(gaussian_count=12, frame_count=6, canonical_every=3)
OTHER_DATA = rebuild_stream(
    (chunk.kind, wire.build_metadata({"capture": "made by foot"}))
    if chunk.kind == container.META
    else (chunk.kind, chunk.payload)
    for chunk in split_chunks(DATA)
)
_MEBIBYTE = bytes(1 << 20)


@dataclass(frozen=True)
class Request:
    """A request to the server, with methods that send a response.

    Attributes:
        connection: Connection to the client.
        number: Index of the request, from 0.
        path: Requested path.
        first: Offset of the first byte of the range.
        last: Offset of the last byte of the range.
        stop_event: Event that is set when the server must end.
    """

    connection: socket.socket
    number: int
    path: str
    first: int
    last: int
    stop_event: threading.Event

    def send(self, text: str, body: bytes = b"") -> None:
        """Send header lines with CRLF line ends, and a body."""
        self.connection.sendall(text.replace("\n", "\r\n").encode() + body)

    def send_head(self, data: bytes = DATA, headers: str = "") -> bytes:
        """Send the head of a correct response without Content-Length; return the body."""
        body = data[self.first : self.last + 1]
        content_range = f"bytes {self.first}-{self.first + len(body) - 1}/{len(data)}"
        self.send(f"HTTP/1.1 206 Partial Content\nContent-Range: {content_range}\n{headers}")
        return body

    def answer(self, data: bytes = DATA, headers: str = "") -> None:
        """Send a correct response."""
        if self.first >= len(data):
            range_headers = f"Content-Range: bytes */{len(data)}\nContent-Length: 0\n{headers}\n"
            self.send(f"HTTP/1.1 416 Range Not Satisfiable\n{range_headers}")
            return
        body = self.send_head(data, headers)
        self.send(f"Content-Length: {len(body)}\n\n", body)

    def send_endlessly(self, data: bytes, pause: float = 0) -> None:
        """Send the same bytes repeatedly until the client disconnects."""
        while not self.stop_event.wait(pause):
            self.connection.sendall(data)


Responder = Callable[[Request], None]


def redirect(request: Request, location: str) -> None:
    """Send a redirect with an endless body."""
    request.send(f"HTTP/1.1 302 Found\nLocation: {location}\n\n")
    request.send_endlessly(_MEBIBYTE)


def redirect_in_a_loop(request: Request) -> None:
    redirect(request, "/stream" if request.path == "/back" else "/back")


def send_headers_slowly(request: Request) -> None:
    request.send("HTTP/1.1 206 Partial Content\nX: ")
    request.send_endlessly(b"x", PAUSE)


def send_continue_endlessly(request: Request) -> None:
    request.send_endlessly(b"HTTP/1.1 100 Continue\r\n\r\n" * 1000)


def send_trailers_endlessly(request: Request) -> None:
    request.send_head(headers="Transfer-Encoding: chunked\n\n")
    request.send("0\n")
    request.send_endlessly(b"X: trailer\r\n" * 1000)


def answer_another_range(request: Request) -> None:
    start = request.first + 1
    content_range = f"bytes {start}-{start + 7}/{len(DATA)}"
    request.send(
        f"HTTP/1.1 206 Partial Content\nContent-Range: {content_range}\nContent-Length: 8\n\n"
    )
    request.send_endlessly(_MEBIBYTE)


def replace_the_file(request: Request) -> None:
    """Serve another valid stream of the same size from the sixth request on."""
    data, tag = (DATA, "one") if request.number < 6 else (OTHER_DATA, "two")
    request.answer(data, f'ETag: "{tag}"\n')


def send_an_endless_chunk(request: Request) -> None:
    request.send_head(headers="Transfer-Encoding: chunked\n\n")
    request.send("7fffffff\n")
    request.send_endlessly(_MEBIBYTE)


def send_gzip(request: Request) -> None:
    request.answer(headers="Content-Encoding: gzip\n")


def redirect_to_a_file(request: Request) -> None:
    redirect(request, "file:///etc/passwd")


def close_early(request: Request) -> None:
    body = request.send_head(headers="Content-Length: 1000\n\n")
    request.send("", body[:3])


def send_slowly(request: Request) -> None:
    request.send_head(headers=f"Content-Length: {request.last + 1 - request.first}\n\n")
    request.send_endlessly(b"x", 6 * PAUSE)


def send_the_whole_file_without_an_end(request: Request) -> None:
    request.send("HTTP/1.1 200 OK\n\n", DATA)
    request.send_endlessly(_MEBIBYTE)


HOSTILE_RESPONDERS: dict[str, tuple[Responder, str]] = {
    "redirect bodies": (redirect_in_a_loop, "redirects in a loop"),
    "slow headers": (send_headers_slowly, "takes more than"),
    "endless continue": (send_continue_endlessly, "takes more than"),
    "endless trailers": (send_trailers_endlessly, "takes more than"),
    "wrong ranges": (answer_another_range, "sends bytes 1 to 8 where 0 to 7 were requested"),
    "swapped file": (replace_the_file, "changed"),
    "endless chunk": (send_an_endless_chunk, "sends more than the 8 bytes"),
    "gzip": (send_gzip, "gzip"),
    "redirect to file:": (redirect_to_a_file, "redirects to 'file:///etc/passwd'"),
    "early close": (close_early, "stops after 3 of 8 bytes"),
    "send_slowly": (send_slowly, "takes more than"),
    "no ranges": (send_the_whole_file_without_an_end, "does not support range requests"),
}
"""For each server: its responder, and a part of the error message of a client."""


class _Server(socketserver.ThreadingTCPServer):
    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, answer: Responder, tls: ssl.SSLContext | None) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.answer, self.tls = answer, tls
        self.request_heads: list[str] = []
        self.stop_event = threading.Event()
        scheme = "https" if tls else "http"
        self.url = f"{scheme}://127.0.0.1:{self.server_address[1]}/stream"

    def handle_error(self, request, client_address) -> None:
        """Ignore errors: the clients of these servers close connections early."""


class _Handler(socketserver.BaseRequestHandler):
    server: _Server

    def handle(self) -> None:
        connection = self.request
        if self.server.tls:
            connection = self.server.tls.wrap_socket(connection, server_side=True)
        with connection, contextlib.suppress(OSError):
            head = b""
            while b"\r\n\r\n" not in head:
                data = connection.recv(1 << 16)
                if not data:
                    return
                head += data
            self.server.answer(self._parse(connection, head.decode()))

    def _parse(self, connection: socket.socket, head: str) -> Request:
        path = head.split(" ")[1]
        match = re.search(r"^Range: bytes=(\d+)-(\d+)\r$", head, re.MULTILINE)
        first, last = map(int, match.groups()) if match else (0, 0)
        self.server.request_heads.append(head)
        number = len(self.server.request_heads) - 1
        return Request(connection, number, path, first, last, self.server.stop_event)


@contextlib.contextmanager
def serve(answer: Responder, tls: ssl.SSLContext | None = None) -> Iterator[_Server]:
    """Run a server in a thread, and yield the server."""
    server = _Server(answer, tls)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield server
    finally:
        server.stop_event.set()
        server.shutdown()
        thread.join()
        server.server_close()


def serve_data(data: bytes) -> contextlib.AbstractContextManager[_Server]:
    """Run a correct server of a stream in a thread, and yield the server."""
    return serve(lambda request: request.answer(data))
