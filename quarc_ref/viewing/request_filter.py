"""Restricts a local server to requests from the page that the user opened.

Any website can make a browser send requests to this machine. Their Host header has a
foreign name in a DNS rebinding attack, and most have an Origin header with the sending
site. Other users and machines do not know the token, which is random for each run and
part of the page's URL.
"""

import hmac
import re
import secrets
from collections.abc import Collection, Sequence

_LOOPBACK = ("localhost", "127.0.0.1", "::1")
_AUTHORITY = re.compile(r"(\[(?P<ipv6>[\da-f:.]+)\]|(?P<name>[^\[\]:/@?#\s]+))(:\d+)?")
_ORIGIN = re.compile(r"https?://(?P<authority>.+)")


class RequestFilter:
    """Decides which requests are accepted.

    Args:
        host: Name or address that the server listens on.
        others: Additional names of the server.

    Attributes:
        token: First part of the path of all resources.
    """

    def __init__(self, host: str, others: Collection[str] = ()) -> None:
        self.token = secrets.token_urlsafe(16)
        self._others = frozenset(name.lower() for name in others)
        self._names = {host.lower(), *_LOOPBACK, *self._others}

    def find_fault(
        self, path: str, hosts: Sequence[str], origins: Sequence[str], address: str
    ) -> str | None:
        """Return why a request is rejected; None if it is accepted.

        Args:
            path: Path of the request, including its query.
            hosts: Values of its Host headers.
            origins: Values of its Origin headers.
            address: Address of this machine that received the request.
        """
        if len(hosts) != 1 or _find_name(hosts[0]) not in {*self._names, address}:
            return "unknown Host: quarc-ref view --allow-host NAME adds one"
        if origins and not (len(origins) == 1 and self._is_own(origins[0], hosts[0])):
            return "the Origin header is that of another site"
        token = path.removeprefix("/").partition("/")[0]
        if not hmac.compare_digest(token.encode(), self.token.encode()):
            return "wrong token: open the URL that quarc-ref view printed"
        return None

    def _is_own(self, origin: str, host: str) -> bool:
        """Return whether an Origin matches the Host or an additional name."""
        match = _ORIGIN.fullmatch(origin.lower())
        if match is None:
            return False
        authority = match["authority"]
        return authority == host.lower() or _find_name(authority) in self._others


def is_host_name(text: str) -> bool:
    """Return whether a text is a host name or address without a port."""
    return _find_name(f"[{text}]" if ":" in text else text) == text.lower()


def _find_name(authority: str) -> str | None:
    """Return the host in `host:port`, or None if it is malformed."""
    match = _AUTHORITY.fullmatch(authority.lower())
    return match and (match["ipv6"] or match["name"])
