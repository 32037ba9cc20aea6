import socket
from contextlib import ExitStack, closing

import pytest

from quarc_ref.viewing import free_port
from quarc_ref.viewing.free_port import find_free_port

_HOST = "127.0.0.1"


def _listen(port=0):
    taken = socket.create_server((_HOST, port))
    return closing(taken), taken.getsockname()[1]


def _listen_at_two_neighbours(stack):
    """Take a port and the next one; return the first."""
    while True:
        with ExitStack() as attempt:
            holder, port = _listen()
            attempt.enter_context(holder)
            try:
                attempt.enter_context(_listen(port + 1)[0])
            except (OSError, OverflowError):
                continue
            stack.push(attempt.pop_all())
            return port


def test_a_port_that_is_free_is_the_one():
    holder, port = _listen()
    with holder:
        pass

    assert find_free_port(_HOST, port) == port


def test_where_a_port_is_taken_it_is_one_of_the_next():
    with ExitStack() as stack:
        port = _listen_at_two_neighbours(stack)

        assert port + 2 <= find_free_port(_HOST, port) < port + 100


def test_not_all_ports_are_tried(monkeypatch):
    monkeypatch.setattr(free_port, "_PORTS_TRIED", 2)
    with ExitStack() as stack:
        port = _listen_at_two_neighbours(stack)
        said = rf"^127.0.0.1 cannot be listened at: .* \(ports {port} to {port + 1}\)$"

        with pytest.raises(OSError, match=said):
            find_free_port(_HOST, port)


def test_there_is_no_port_beyond_the_last(monkeypatch):
    with ExitStack() as stack:
        port = _listen_at_two_neighbours(stack)
        monkeypatch.setattr(free_port, "_LAST_PORT", port + 1)

        with pytest.raises(OSError, match=rf"\(ports {port} to {port + 1}\)$"):
            find_free_port(_HOST, port)


@pytest.mark.parametrize("host", ["300.1.1.1", "192.0.2.1", "nosuchhost.invalid", "a..b", "x" * 70])
def test_a_host_that_is_not_this_machine_is_named(host):
    with pytest.raises(OSError, match=rf"^{host} cannot be listened at: \S+") as caught:
        find_free_port(host, 8080)

    assert "ports" not in str(caught.value)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "0.0.0.0", ""])
def test_this_machine_can_be_listened_at(host):
    assert find_free_port(host, 20_000) >= 20_000
