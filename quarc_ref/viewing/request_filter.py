"""Restricts a local server to requests from the page that the user opened.

Any website can make a browser send requests to this machine. In a DNS rebinding attack, the Host
header of the request contains a host name of the attacker. In most other attacks, the Origin header
contains the address of the attacking website. Requests with such a Host or Origin header are
rejected, and so are requests whose URL does not contain the token. The token is a random part of
the page's URL; it changes with each run and is unknown to other machines. If `view` opens a
browser, other users of this machine can read it in the list of processes.
"""

import hmac
import re
import secrets
from collections.abc import Collection, Sequence
from ipaddress import AddressValueError, IPv6Address

_LOOPBACK_HOSTS = ("localhost", "127.0.0.1", "::1")
_AUTHORITY_PATTERN = re.compile(r"(\[(?P<ipv6>[\da-f:.]+)\]|(?P<name>[^\[\]:/@?#\s]+))(:\d+)?")
_ORIGIN_PATTERN = re.compile(r"https?://(?P<authority>.+)")


class RequestFilter:
    """Decides which requests are accepted.

    Args:
        host: Host name or address on which the server listens.
        extra_names: Additional host names of the server.

    Attributes:
        token: Random string with which the path of every resource begins.
    """

    def __init__(self, host: str, extra_names: Collection[str] = ()) -> None:
        self.token = secrets.token_urlsafe(16)
        self._extra_names = frozenset(name.lower() for name in extra_names)
        self._accepted_names = {host.lower(), *_LOOPBACK_HOSTS, *self._extra_names}

    def find_rejection_reason(
        self, path: str, hosts: Sequence[str], origins: Sequence[str], address: str
    ) -> str | None:
        """Return the reason to reject a request; None if the request is accepted.

        Args:
            path: Path of the request, including the query.
            hosts: Values of the Host headers.
            origins: Values of the Origin headers.
            address: Address of this machine at which the request arrived.
        """
        accepted_names = {*self._accepted_names, _unmap_address(address)}
        if len(hosts) != 1 or _parse_host(hosts[0]) not in accepted_names:
            return (
                "the name in the Host header is unknown; quarc-ref view --allow-host NAME allows it"
            )
        if origins and not (len(origins) == 1 and self._is_same_site(origins[0], hosts[0])):
            return "the Origin header names another site"
        token = path.partition("?")[0].removeprefix("/").partition("/")[0]
        if not hmac.compare_digest(token.encode(), self.token.encode()):
            return "the token is wrong; open the URL that quarc-ref view printed"
        return None

    def _is_same_site(self, origin: str, host: str) -> bool:
        """Return whether an Origin header matches the Host header or an additional name."""
        match = _ORIGIN_PATTERN.fullmatch(origin.lower())
        if match is None:
            return False
        authority = match["authority"]
        return authority == host.lower() or _parse_host(authority) in self._extra_names


def is_host_name(text: str) -> bool:
    """Return whether a text is a host name or address without a port."""
    return _parse_host(f"[{text}]" if ":" in text else text) == text.lower()


def _unmap_address(address: str) -> str:
    """Return the IPv4 address that an IPv6 address such as `::ffff:192.0.2.1` contains.

    A socket for both versions reports the addresses of IPv4 clients in this form.
    """
    try:
        mapped = IPv6Address(address).ipv4_mapped
    except AddressValueError:  # an IPv4 address
        return address
    return address if mapped is None else str(mapped)


def _parse_host(authority: str) -> str | None:
    """Return the host in `host:port`; None if the text is malformed."""
    match = _AUTHORITY_PATTERN.fullmatch(authority.lower())
    return match and (match["ipv6"] or match["name"])
