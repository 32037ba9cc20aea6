"""Servers that answer wrongly, intentionally or not: each is a function that answers one request.

They use plain sockets, since the servers of the standard library follow HTTP.
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
OTHER = rebuild_stream(
    (chunk.kind, wire.build_metadata({"capture": "made by foot"}))
    if chunk.kind == container.META
    else (chunk.kind, chunk.payload)
    for chunk in split_chunks(DATA)
)
_MEBIBYTE = bytes(1 << 20)


@dataclass(frozen=True)
class Request:
    """A request, and the functions to answer it.

    Attributes:
        connection: Connection to the client.
        number: Index of the request, from 0.
        path: Requested path.
        first: First byte of the range.
        last: Its last byte.
        let_go: Set when the server must end.
    """

    connection: socket.socket
    number: int
    path: str
    first: int
    last: int
    let_go: threading.Event

    def send(self, text: str, body: bytes = b"") -> None:
        """Send lines with line ends, and a body."""
        self.connection.sendall(text.replace("\n", "\r\n").encode() + body)

    def send_head(self, data: bytes = DATA, more: str = "") -> bytes:
        """Send the head of a correct response without the length of its body; return the body."""
        body = data[self.first : self.last + 1]
        message = f"bytes {self.first}-{self.first + len(body) - 1}/{len(data)}"
        self.send(f"HTTP/1.1 206 Partial Content\nContent-Range: {message}\n{more}")
        return body

    def answer(self, data: bytes = DATA, more: str = "") -> None:
        """Answer correctly."""
        if self.first >= len(data):
            message = f"Content-Range: bytes */{len(data)}\nContent-Length: 0\n{more}\n"
            self.send(f"HTTP/1.1 416 Range Not Satisfiable\n{message}")
            return
        body = self.send_head(data, more)
        self.send(f"Content-Length: {len(body)}\n\n", body)

    def send_endlessly(self, piece: bytes, pause: float = 0) -> None:
        """Send the same bytes repeatedly until the client disconnects."""
        while not self.let_go.wait(pause):
            self.connection.sendall(piece)


Answer = Callable[[Request], None]


def redirect(request: Request, location: str) -> None:
    """Redirect with an endless body."""
    request.send(f"HTTP/1.1 302 Found\nLocation: {location}\n\n")
    request.send_endlessly(_MEBIBYTE)


def redirect_in_a_circle(request: Request) -> None:
    redirect(request, "/stream" if request.path == "/back" else "/back")


def send_headers_slowly(request: Request) -> None:
    request.send("HTTP/1.1 206 Partial Content\nX: ")
    request.send_endlessly(b"x", PAUSE)


def send_continue_endlessly(request: Request) -> None:
    request.send_endlessly(b"HTTP/1.1 100 Continue\r\n\r\n" * 1000)


def send_trailers_endlessly(request: Request) -> None:
    request.send_head(more="Transfer-Encoding: chunked\n\n")
    request.send("0\n")
    request.send_endlessly(b"X: trailer\r\n" * 1000)


def answer_another_range(request: Request) -> None:
    start = request.first + 1
    message = f"bytes {start}-{start + 7}/{len(DATA)}"
    request.send(f"HTTP/1.1 206 Partial Content\nContent-Range: {message}\nContent-Length: 8\n\n")
    request.send_endlessly(_MEBIBYTE)


def swap_the_file(request: Request) -> None:
    """Serve another valid stream of the same size from the sixth request on."""
    data, tag = (DATA, "one") if request.number < 6 else (OTHER, "two")
    request.answer(data, f'ETag: "{tag}"\n')


def send_an_endless_chunk(request: Request) -> None:
    request.send_head(more="Transfer-Encoding: chunked\n\n")
    request.send("7fffffff\n")
    request.send_endlessly(_MEBIBYTE)


def send_gzip(request: Request) -> None:
    request.answer(more="Content-Encoding: gzip\n")


def redirect_to_a_file(request: Request) -> None:
    redirect(request, "file:///etc/passwd")


def close_early(request: Request) -> None:
    body = request.send_head(more="Content-Length: 1000\n\n")
    request.send("", body[:3])


def send_slowly(request: Request) -> None:
    request.send_head(more=f"Content-Length: {request.last + 1 - request.first}\n\n")
    request.send_endlessly(b"x", 6 * PAUSE)


def send_the_whole_file_without_an_end(request: Request) -> None:
    request.send("HTTP/1.1 200 OK\n\n", DATA)
    request.send_endlessly(_MEBIBYTE)


HOSTILE: dict[str, tuple[Answer, str]] = {
    "redirect bodies": (redirect_in_a_circle, "redirects in a loop"),
    "slow headers": (send_headers_slowly, "takes more than"),
    "endless continue": (send_continue_endlessly, "takes more than"),
    "endless trailers": (send_trailers_endlessly, "takes more than"),
    "wrong ranges": (answer_another_range, "sends bytes 1 to 8 where 0 to 7 were requested"),
    "swapped file": (swap_the_file, "changed"),
    "endless chunk": (send_an_endless_chunk, "sends more than the 8 bytes"),
    "gzip": (send_gzip, "gzip"),
    "redirect to file:": (redirect_to_a_file, "redirects to 'file:///etc/passwd'"),
    "early close": (close_early, "stops after 3 bytes of 8"),
    "send_slowly": (send_slowly, "takes more than"),
    "no ranges": (send_the_whole_file_without_an_end, "does not support range requests"),
}
"""Of each server its answer, and what is said of it when a stream is read from there."""


class _Server(socketserver.ThreadingTCPServer):
    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, answer: Answer, tls: ssl.SSLContext | None) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.answer, self.tls = answer, tls
        self.asked: list[str] = []
        self.let_go = threading.Event()
        scheme = "https" if tls else "http"
        self.url = f"{scheme}://127.0.0.1:{self.server_address[1]}/stream"

    def handle_error(self, request, client_address) -> None:
        """Do not log: clients of these servers hang up."""


class _Handler(socketserver.BaseRequestHandler):
    server: _Server

    def handle(self) -> None:
        connection = self.request
        if self.server.tls:
            connection = self.server.tls.wrap_socket(connection, server_side=True)
        with connection, contextlib.suppress(OSError):
            head = b""
            while b"\r\n\r\n" not in head:
                piece = connection.recv(1 << 16)
                if not piece:
                    return
                head += piece
            self.server.answer(self._parse(connection, head.decode()))

    def _parse(self, connection: socket.socket, head: str) -> Request:
        path = head.split(" ")[1]
        found = re.search(r"^Range: bytes=(\d+)-(\d+)\r$", head, re.MULTILINE)
        first, last = map(int, found.groups()) if found else (0, 0)
        self.server.asked.append(head)
        number = len(self.server.asked) - 1
        return Request(connection, number, path, first, last, self.server.let_go)


@contextlib.contextmanager
def serve(answer: Answer, tls: ssl.SSLContext | None = None) -> Iterator[_Server]:
    """Run a server; yield it."""
    server = _Server(answer, tls)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield server
    finally:
        server.let_go.set()
        server.shutdown()
        thread.join()
        server.server_close()
