"""Who is let in to a page: browsers that know its key and ask for it under its own name.

Any website can have a browser ask this machine for something. The browser then
says for which host it asks (Host), which is a foreign name where a name has been
made to lead here (DNS rebinding), and which page asks (Origin). The key is part
of the page's address; from there a cookie takes it to the websocket, which
others on the machine or on the network do not have.
"""

import hmac
import logging
import re
import secrets
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qs

import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

_LOOPBACK = ("localhost", "127.0.0.1", "::1")
_AUTHORITY = re.compile(r"(\[(?P<ipv6>[\da-f:.]+)\]|(?P<name>[^\[\]:/@?#\s]+))(:\d+)?")
_ORIGIN = re.compile(r"https?://(?P<authority>.+)")
_SILENT = logging.getLogger(__name__)  # what strangers send is not for the terminal
_SILENT.disabled = True

_Answerer = Callable[[ServerConnection, Request], Response | None]


class Doorkeeper:
    """Refuses requests that are not from a page's own browser windows.

    Args:
        host: Name or address that is listened at.
        others: More names that browsers may know the page by.

    Attributes:
        key: What the page's address has to say, as its parameter `key`.
    """

    def __init__(self, host: str, others: Collection[str] = ()) -> None:
        self.key = secrets.token_urlsafe(16)
        self._others = frozenset(name.lower() for name in others)
        self._names = {host.lower(), *_LOOPBACK, *self._others}

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Have a server of websockets that is started meanwhile ask here about every request."""
        serve = websockets.asyncio.server.serve

        def serve_guarded(
            *arguments: Any,  # noqa: ANN401
            process_request: _Answerer,
            **options: Any,  # noqa: ANN401
        ) -> websockets.asyncio.server.serve:
            def answer(connection: ServerConnection, request: Request) -> Response | None:
                return self._answer(connection, request, process_request)

            return serve(*arguments, process_request=answer, logger=_SILENT, **options)

        websockets.asyncio.server.serve = serve_guarded  # type: ignore[assignment,misc]
        try:
            yield
        finally:
            websockets.asyncio.server.serve = serve  # type: ignore[misc]

    def _answer(
        self, connection: ServerConnection, request: Request, answer: _Answerer
    ) -> Response | None:
        """Answer a request, or the beginning of a websocket, which None lets go on."""
        address, port = connection.local_address[:2]
        cookie = f"quarc-ref-{port}"
        fault = self._find_fault(request, address, cookie)
        if fault:
            return connection.respond(HTTPStatus.FORBIDDEN, f"Refused: {fault}.\n")
        response = answer(connection, request)
        if response is not None:
            how = "Path=/; HttpOnly; SameSite=Strict"
            response.headers["Set-Cookie"] = f"{cookie}={self.key}; {how}"
        return response

    def _find_fault(self, request: Request, address: str, cookie: str) -> str | None:
        """Return why a request is refused, if it is.

        Args:
            request: From a browser, or from anything else.
            address: At which it came in.
            cookie: What the cookie with the key is called.
        """
        hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
        if len(hosts) != 1 or _find_name(hosts[0]) not in {*self._names, address}:
            return "the Host is not one of this page: quarc-ref view --allow-host NAME adds one"
        if origins and not (len(origins) == 1 and self._is_own(origins[0], hosts[0])):
            return "the Origin is another page"
        if not self._has_key(request, cookie):
            return "the key is missing: open the address that quarc-ref view has printed"
        return None

    def _is_own(self, origin: str, host: str) -> bool:
        """Return whether an Origin is the Host itself, or one of the names that were added."""
        match = _ORIGIN.fullmatch(origin.lower())
        if match is None:
            return False
        authority = match["authority"]
        return authority == host.lower() or _find_name(authority) in self._others

    def _has_key(self, request: Request, cookie: str) -> bool:
        keys = parse_qs(request.path.partition("?")[2]).get("key", [])
        keys += _list_cookies(request.headers, cookie)
        return any(hmac.compare_digest(key.encode(), self.key.encode()) for key in keys)


def is_host_name(text: str) -> bool:
    """Return whether a text is the name or the address of a host, without a port."""
    return _find_name(f"[{text}]" if ":" in text else text) == text.lower()


def _find_name(authority: str) -> str | None:
    """Return the host of `host:port`; None if that is not what it is."""
    match = _AUTHORITY.fullmatch(authority.lower())
    return match and (match["ipv6"] or match["name"])


def _list_cookies(headers: Headers, name: str) -> list[str]:
    parts = (part.strip() for line in headers.get_all("Cookie") for part in line.split(";"))
    pairs = (part.partition("=") for part in parts)
    return [value for key, _, value in pairs if key == name]
