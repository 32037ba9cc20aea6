"""Reads streams from HTTP servers that support range requests: SPEC 11.2."""

import re
import time
from http.client import HTTPException, HTTPResponse, IncompleteRead
from typing import NoReturn
from urllib.error import URLError

from quarc_ref.format.errors import SourceError
from quarc_ref.streams.file_version import Change, FileVersion
from quarc_ref.streams.http_client import (
    HttpClient,
    RedirectError,
    is_temporary_error,
    is_temporary_status,
    remove_credentials,
)

_PARTIAL_CONTENT = 206
_RANGE_NOT_SATISFIABLE = 416
_CONTENT_RANGE_PATTERN = re.compile(r"bytes (\d{1,20})-(\d{1,20})/(\d{1,20}|\*)")
_UNSATISFIED_RANGE_PATTERN = re.compile(r"bytes \*/(\d{1,20})")
_PIECE_BYTES = 1 << 16
_SAMPLE_BYTES = 64
_DEFAULT_PATIENCE = 2.0  # four retries
_FIRST_PAUSE = 0.1
_MAX_PAUSE = 3.2


class _TemporaryError(SourceError):
    """A request failed, but a later one may succeed."""


class HttpSource:
    """A stream at an HTTP URL; only the requested ranges are downloaded.

    The file on the server may grow while it is read, but must not change in other ways. Each
    response is compared with the known size, ETag and modification time. If these do not
    show whether the file has only grown, some bytes are read again and compared. Requests
    do not use `If-Range` or `If-Match`, which would reject a file that has only grown.

    Args:
        url: URL of the stream, `http` or `https`, with user and password if the server requires
            Basic authentication.
        timeout: Maximum seconds, including redirects, from connecting to the last byte of a
            response.
        patience: Seconds for which a request is repeated, with pauses, while the connection breaks,
            the server does not respond in time, or it reports a temporary error.
    """

    def __init__(
        self, url: str, timeout: float = 30.0, patience: float = _DEFAULT_PATIENCE
    ) -> None:
        self._url = url
        self._timeout = timeout
        self._patience = patience
        self._client = HttpClient()
        self._version = FileVersion()
        self._sample = (0, b"")  # an offset, and the bytes read there

    def read(self, offset: int, length: int) -> bytes:
        """Read `length` bytes at `offset`, or fewer at the end of the stream.

        Raises:
            SourceError: The server does not respond, its response is invalid, or the file has
                changed.
        """
        return self._fetch(offset, length)[0] if length else b""

    def size(self) -> int | None:
        """Return the current size of the file in bytes; None if unknown.

        Raises:
            SourceError: See `read`.
        """
        return self._fetch(0, 1)[1]

    def _fetch(self, offset: int, length: int) -> tuple[bytes, int | None]:
        """Fetch a range, and check that the file has only grown since the last request."""
        body, version = self._request(offset, length)
        change = self._version.compare(version)
        if change is Change.REPLACED or (change is Change.GROWN and not self._sample_matches()):
            self._raise_error("now has a different file: it was changed while it was being read")
        self._version = self._version.merged_with(version)
        self._store_sample(offset, body)
        return body, version.size

    def _store_sample(self, offset: int, body: bytes) -> None:
        """Store the last bytes of a body as a sample, unless the stored sample is longer."""
        sample = body[-_SAMPLE_BYTES:]
        if len(sample) >= len(self._sample[1]):
            self._sample = (offset + len(body) - len(sample), sample)

    def _sample_matches(self) -> bool:
        """Return whether the file still contains the sample."""
        offset, sample = self._sample
        return not sample or self._request(offset, len(sample))[0] == sample

    def _request(self, offset: int, length: int) -> tuple[bytes, FileVersion]:
        """Request a range until it succeeds, and return its bytes and the file's version."""
        pause, deadline = _FIRST_PAUSE, time.monotonic() + self._patience
        while True:
            try:
                return self._request_once(offset, length)
            except _TemporaryError:
                if time.monotonic() + pause > deadline:
                    raise
            time.sleep(pause)
            pause = min(2 * pause, _MAX_PAUSE)

    def _request_once(self, offset: int, length: int) -> tuple[bytes, FileVersion]:
        request_headers = {
            "Range": f"bytes={offset}-{offset + length - 1}",
            "Accept-Encoding": "identity",
        }
        try:
            with self._client.get(self._url, request_headers, self._timeout) as response:
                return self._read_response(response, offset, length)
        except RedirectError as error:
            self._raise_error(str(error))
        except (OSError, HTTPException, ValueError) as error:
            reason = error.reason if isinstance(error, URLError) else error
            if isinstance(reason, TimeoutError):
                problem = f"takes more than {self._timeout} seconds to answer"
            else:
                problem = f"cannot be read: {_describe_error(reason)}"
            self._raise_error(problem, is_temporary=is_temporary_error(reason))

    def _read_response(
        self, response: HTTPResponse, offset: int, length: int
    ) -> tuple[bytes, FileVersion]:
        content_range = response.headers.get("Content-Range", "")
        if response.status == _RANGE_NOT_SATISFIABLE:
            return b"", self._parse_unsatisfied_range(content_range, offset)
        if response.status != _PARTIAL_CONTENT:
            self._raise_status_error(response)
        encoding = response.headers.get("Content-Encoding", "identity")
        if encoding.lower() != "identity":
            self._raise_error(
                f"answers with content encoding {encoding!r}: it must send the file unencoded"
            )
        match = _CONTENT_RANGE_PATTERN.fullmatch(content_range)
        if match is None:
            self._raise_error("does not state which bytes it sends")
        first, last = int(match[1]), int(match[2])
        size = None if match[3] == "*" else int(match[3])
        end = offset + length if size is None else min(offset + length, size)
        if first != offset or (last + 1 != end if size is not None else last >= end):
            self._raise_error(
                f"sends bytes {first} to {last} where {offset} to {end - 1} were requested"
            )
        version = FileVersion.from_headers(response.headers, size)
        return self._read_body(response, last + 1 - first), version

    def _parse_unsatisfied_range(self, content_range: str, offset: int) -> FileVersion:
        """Return the version of a file that is too short for a requested range.

        Raises:
            SourceError: According to its size, the file contains the start of the range.
        """
        match = _UNSATISFIED_RANGE_PATTERN.fullmatch(content_range)
        if match and int(match[1]) > offset:
            self._raise_error(f"does not send byte {offset} of a file of {match[1]} bytes")
        return FileVersion(int(match[1]) if match else None)

    def _read_body(self, response: HTTPResponse, length: int) -> bytes:
        """Read a complete body, whose transfer encoding may be chunked."""
        body, piece = bytearray(), b"more"
        while piece and len(body) <= length:
            try:
                piece = response.read1(min(_PIECE_BYTES, length + 1 - len(body)))
            except IncompleteRead:
                piece = b""
            body += piece
        if len(body) < length:
            self._raise_error(f"stops after {len(body)} of {length} bytes", is_temporary=True)
        if len(body) > length:
            self._raise_error(f"sends more than the {length} bytes that were requested")
        return bytes(body)

    def _raise_status_error(self, response: HTTPResponse) -> NoReturn:
        if 200 <= response.status < 300:
            self._raise_error("does not support range requests: download the stream to decode it")
        self._raise_error(
            f"answers {response.status} {response.reason}",
            is_temporary=is_temporary_status(response.status),
        )

    def _raise_error(self, problem: str, *, is_temporary: bool = False) -> NoReturn:
        message = f"the server of {remove_credentials(self._url)} {problem}"
        raise _TemporaryError(message) if is_temporary else SourceError(message)


def _describe_error(reason: object) -> str:
    """Return the message of an error, without its errno."""
    return getattr(reason, "strerror", None) or str(reason) or repr(reason)
