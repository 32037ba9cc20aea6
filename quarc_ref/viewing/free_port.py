"""A port to listen at, found before a server is begun.

viser's own search goes on after faults that no other port mends, and beyond the
last port there is. Then its thread ends, and whoever began it waits for good.
"""

import errno
import os
import socket
from typing import Any

_PORTS_TRIED = 100
_LAST_PORT = 65535
_ANOTHER_PORT_MAY_DO = (errno.EADDRINUSE, errno.EACCES)

_Addresses = set[tuple[socket.AddressFamily, tuple[Any, ...]]]


def find_free_port(host: str, port: int) -> int:
    """Return the first port from `port` on at which a host can be listened at.

    Args:
        host: Name or address of this machine; all addresses of a name count.
        port: The first to try; 100 are at most, and none above 65535.

    Raises:
        OSError: The host is not this machine, or none of the ports is free.
    """
    ports = range(port, min(port + _PORTS_TRIED, _LAST_PORT + 1))
    try:
        return _search(_resolve(host), ports)
    except (OSError, UnicodeError) as error:  # UnicodeError: no name that a host may have
        why = getattr(error, "strerror", None) or str(error)
        if getattr(error, "errno", None) in _ANOTHER_PORT_MAY_DO:
            why += f" (ports {ports.start} to {ports[-1]})"
        message = f"{host} cannot be listened at: {why}"
        raise OSError(message) from error


def _resolve(host: str) -> _Addresses:
    kind, passive = socket.SOCK_STREAM, socket.AI_PASSIVE
    found = socket.getaddrinfo(host or None, 0, type=kind, flags=passive)
    return {(family, address) for family, _, _, _, address in found}


def _search(addresses: _Addresses, ports: range) -> int:
    """Return the first port that can be bound at all addresses.

    Raises:
        OSError: What no other port mends, or what is wrong with the last.
    """
    for port in ports:
        try:
            _bind(addresses, port)
        except OSError as error:
            if port == ports[-1] or error.errno not in _ANOTHER_PORT_MAY_DO:
                raise
        else:
            break
    return port


def _bind(addresses: _Addresses, port: int) -> None:
    """Bind a port as the server is going to, and let go of it."""
    for family, (name, _, *scope) in addresses:
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            if os.name == "posix":  # what has just ended is in nobody's way
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if family == socket.AF_INET6:
                probe.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            probe.bind((name, port, *scope))
