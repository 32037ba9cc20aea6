"""A stream on a server that answers ranges: SPEC 11.2."""

import re
import time
from http.client import HTTPException, HTTPResponse
from typing import NoReturn
from urllib.error import HTTPError, URLError
from urllib.request import (
    HTTPDefaultErrorHandler,
    HTTPErrorProcessor,
    HTTPHandler,
    HTTPRedirectHandler,
    HTTPSHandler,
    OpenerDirector,
    ProxyHandler,
    Request,
    UnknownHandler,
)

from quarc_ref.format.errors import SourceError

_PARTIAL = 206
_BEYOND_THE_END = 416
_RANGE = re.compile(r"bytes (\d+)-(\d+)/(\d+|\*)")
_TOTAL = re.compile(r"bytes \*/(\d+)")
_PIECE_BYTES = 1 << 16
_HANDLERS = (
    ProxyHandler,
    HTTPHandler,
    HTTPSHandler,
    HTTPRedirectHandler,
    HTTPErrorProcessor,
    HTTPDefaultErrorHandler,
    UnknownHandler,
)


class HttpSource:
    """A stream at an HTTP URL. Nothing but the ranges that are asked for is read.

    Args:
        url: Of the stream, `http` or `https`.
        timeout: Seconds that the server has to begin an answer, and again to end it.
    """

    def __init__(self, url: str, timeout: float = 30.0) -> None:
        self._url = url
        self._timeout = timeout
        self._opener = OpenerDirector()  # without the handlers of files and FTP
        for handler in _HANDLERS:
            self._opener.add_handler(handler())

    def read(self, offset: int, length: int) -> bytes:
        """Return `length` bytes from `offset` on, fewer at the end of the stream.

        Raises:
            SourceError: The server does not answer, or answers something else.
        """
        return self._fetch(offset, length)[0] if length else b""

    def size(self) -> int | None:
        """Ask the server how many bytes there are now; None where it does not say.

        Raises:
            SourceError: The server does not answer, or answers something else.
        """
        return self._fetch(0, 1)[1]

    def _fetch(self, offset: int, length: int) -> tuple[bytes, int | None]:
        """Return a range and the size of the whole."""
        wanted = {"Range": f"bytes={offset}-{offset + length - 1}", "Accept-Encoding": "identity"}
        try:
            request = Request(self._url, headers=wanted)
            with self._opener.open(request, timeout=self._timeout) as response:
                return self._take(response, offset, length)
        except HTTPError as error:
            error.close()
            if error.code == _BEYOND_THE_END:
                found = _TOTAL.fullmatch(error.headers.get("Content-Range", ""))
                return b"", int(found[1]) if found else None
            self._refuse(f"answers {error.code} {error.reason}")
        except (OSError, HTTPException, ValueError) as error:
            self._refuse(f"cannot be read: {_name_reason(error)}")

    def _take(self, response: HTTPResponse, offset: int, length: int) -> tuple[bytes, int | None]:
        if response.status != _PARTIAL:
            self._refuse("does not answer ranges: download the stream to decode it")
        found = _RANGE.fullmatch(response.headers.get("Content-Range", ""))
        if found is None:
            self._refuse("does not say which bytes it answers")
        first, last = int(found[1]), int(found[2])
        total = None if found[3] == "*" else int(found[3])
        end = offset + length if total is None else min(offset + length, total)
        if first != offset or (last + 1 != end if total is not None else last >= end):
            self._refuse(f"answers bytes {first} to {last} where {offset} to {end - 1} are due")
        return self._read_body(response, last + 1 - first), total

    def _read_body(self, response: HTTPResponse, length: int) -> bytes:
        body, deadline = bytearray(), time.monotonic() + self._timeout
        while len(body) < length:
            piece = response.read1(min(_PIECE_BYTES, length - len(body)))
            if not piece:
                self._refuse(f"stops after {len(body)} bytes of {length}")
            if time.monotonic() > deadline:
                self._refuse(f"takes more than {self._timeout} seconds")
            body += piece
        return bytes(body)

    def _refuse(self, what: str) -> NoReturn:
        message = f"the server of {self._url} {what}"
        raise SourceError(message)


def _name_reason(error: Exception) -> str:
    """Return what went wrong, without urllib's wrapping and the system's number for it."""
    reason = error.reason if isinstance(error, URLError) else error
    return getattr(reason, "strerror", None) or str(reason) or repr(reason)
