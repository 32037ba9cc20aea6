"""Sends HTTP requests and follows redirects, with one deadline for all of them."""

import base64
import errno
import re
import socket
import ssl
import string
from collections.abc import Mapping
from functools import cached_property
from http.client import HTTPResponse
from urllib.parse import quote, unquote_to_bytes, urldefrag, urljoin, urlsplit
from urllib.request import HTTPHandler, OpenerDirector, ProxyHandler, Request

from quarc_ref.streams.timed_connection import (
    Deadline,
    TimedConnection,
    TimedTlsConnection,
    make_tls_context,
)

_REDIRECT_STATUSES = (301, 302, 303, 307, 308)
_TEMPORARY_STATUSES = (408, 425, 429)  # Request Timeout, Too Early, Too Many Requests
_NETWORK_ERROR_CODES = (errno.ENETDOWN, errno.ENETUNREACH, errno.EHOSTUNREACH)
_SCHEMES = ("http", "https")
_MAX_REDIRECTS = 5
_CREDENTIALS_PATTERN = re.compile(r"^([^/?#]*//)[^/?#]*@")


class RedirectError(Exception):
    """A redirect is rejected; the message says why."""


class HttpClient:
    """Sends HTTP requests, through proxies if the environment variables configure any."""

    def __init__(self) -> None:
        self._opener = OpenerDirector()
        for handler in (ProxyHandler(), _TimedHandler()):
            self._opener.add_handler(handler)

    def get(self, url: str, headers: Mapping[str, str], timeout: float) -> HTTPResponse:
        """Send a GET request and follow redirects, whose bodies are not read.

        Args:
            url: URL, `http` or `https`. A user and a password in it are sent as Basic
                authentication, but not to other origins.
            headers: Headers of the request.
            timeout: Maximum seconds, including redirects, until the last byte of the response's
                body has been read.

        Returns:
            The response, whatever its status. Reading its body after the deadline raises a
            TimeoutError.

        Raises:
            OSError: The server cannot be reached, or (TimeoutError) does not answer in time.
            HTTPException: The response is not valid HTTP.
            RedirectError: The response redirects to a rejected target.
            ValueError: The URL is not an http or https URL.
        """
        deadline, visited_urls = Deadline(timeout), [_normalize_url(url)]
        credentials = _make_authorization(url)
        while True:
            is_same_origin = _get_origin(visited_urls[-1]) == _get_origin(visited_urls[0])
            private_headers = credentials if is_same_origin else {}
            request = Request(visited_urls[-1], headers={**headers, **private_headers})
            response: HTTPResponse = self._opener.open(request, timeout=deadline.remaining())
            if response.status not in _REDIRECT_STATUSES:
                return response
            response.close()
            target = resolve_redirect(visited_urls[-1], response.headers.get("Location"))
            if target in visited_urls:
                message = f"redirects in a loop that leads back to {target}"
                raise RedirectError(message)
            if len(visited_urls) > _MAX_REDIRECTS:
                message = f"redirects more than {_MAX_REDIRECTS} times"
                raise RedirectError(message)
            visited_urls.append(target)


def is_temporary_status(status: int) -> bool:
    """Return whether a later request may succeed after this status."""
    return status >= 500 or status in _TEMPORARY_STATUSES


def is_temporary_error(error: object) -> bool:
    """Return whether a later request may succeed after this error of a connection."""
    if isinstance(error, socket.gaierror):
        return error.errno == socket.EAI_AGAIN
    if isinstance(error, ConnectionError | TimeoutError | ssl.SSLEOFError):
        return True
    return isinstance(error, OSError) and error.errno in _NETWORK_ERROR_CODES


def resolve_redirect(url: str, location: str | None) -> str:
    """Return the target URL of a redirect.

    Args:
        url: Requested URL.
        location: Location header, which may be relative to the URL.

    Raises:
        RedirectError: The target is missing or is not an HTTP URL, or the redirect leads from
            HTTPS to HTTP.
    """
    if not location:
        message = "redirects without a target URL"
        raise RedirectError(message)
    target = quote(urljoin(url, location), safe=string.punctuation, encoding="latin-1")
    source_scheme, target_scheme = urlsplit(url).scheme, urlsplit(target).scheme
    if target_scheme not in _SCHEMES:
        message = f"redirects to {location!r}: only http and https URLs are followed"
        raise RedirectError(message)
    if (source_scheme, target_scheme) == ("https", "http"):
        message = (
            f"redirects from https to {location!r}: a redirect from https must lead to an https URL"
        )
        raise RedirectError(message)
    return remove_credentials(urldefrag(target).url)


def remove_credentials(url: str) -> str:
    """Return a URL, which may be invalid, without user and password."""
    return _CREDENTIALS_PATTERN.sub(r"\1", url)


def _get_origin(url: str) -> tuple[str, str | None, int | None]:
    parts = urlsplit(url)
    default_port = {"http": 80, "https": 443}.get(parts.scheme)
    return parts.scheme, parts.hostname, parts.port or default_port


def _make_authorization(url: str) -> dict[str, str]:
    """Return the header of Basic authentication (RFC 7617) for a URL's user and password."""
    user, _, password = urlsplit(url).netloc.rpartition("@")[0].partition(":")
    if not (user or password):
        return {}
    token = unquote_to_bytes(user) + b":" + unquote_to_bytes(password)
    return {"Authorization": f"Basic {base64.b64encode(token).decode()}"}


def _normalize_url(url: str) -> str:
    """Return a URL without credentials and fragment, with characters escaped as HTTP requires."""
    parts = urlsplit(remove_credentials(url))
    if parts.scheme not in _SCHEMES:
        message = f"{url!r} is not an http or https URL"
        raise ValueError(message)
    path, query = (quote(part, safe=string.punctuation) for part in (parts.path, parts.query))
    return parts._replace(path=path, query=query, fragment="").geturl()


class _TimedHandler(HTTPHandler):
    https_request = HTTPHandler.http_request

    def http_open(self, req: Request) -> HTTPResponse:
        return self.do_open(TimedConnection, req)

    def https_open(self, req: Request) -> HTTPResponse:
        return self.do_open(TimedTlsConnection, req, context=self._tls_context)

    @cached_property
    def _tls_context(self) -> ssl.SSLContext:
        # Certificates load slowly, so they are loaded only once and only for TLS.
        return make_tls_context()
