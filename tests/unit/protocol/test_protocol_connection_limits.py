"""The connection slots of a server, and their end when the system is out of threads."""

import socket
import socketserver
import threading

import pytest

from palaestra_protocol.connection_limits import ConnectionSlots
from palaestra_protocol.tcp_server import TcpServer


@pytest.fixture
def connected():
    """Yield a function that returns a connected socket and its peer."""
    made = []

    def pair():
        made.extend(both := socket.socketpair())
        return both

    yield pair
    for each in made:
        each.close()


def test_a_request_that_ends_after_its_connection_was_closed_takes_no_slot(connected):
    """A thread finishes its request after `clear`, and a slot without connection would never become free."""
    slots = ConnectionSlots(most=1)
    closed, peer = connected()
    slots.take(closed, "127.0.0.1")
    slots.answering(closed, now=True)
    slots.clear()

    slots.answering(closed, now=False)

    assert peer.recv(1) == b""
    assert slots.take(connected()[0], "127.0.0.2")
    slots.answering(closed, now=True)
    assert slots.take(connected()[0], "127.0.0.3")


def test_a_connection_without_a_thread_gives_its_slot_back(monkeypatch, connected):
    """A pod reaches its limit of processes, and later accepts connections again."""

    def fail(_):
        raise RuntimeError("can't start new thread")

    slots = ConnectionSlots(most=1)
    server = TcpServer(("127.0.0.1", 0), socketserver.BaseRequestHandler, name="test", slots=slots)
    with socket.create_connection(("127.0.0.1", server.port), timeout=30.0) as connection:
        with monkeypatch.context() as patched:
            patched.setattr(threading.Thread, "start", fail)
            server.handle_request()
        closed = connection.recv(1)
    server.close()

    assert closed == b""
    busy = connected()[0]
    assert slots.take(busy, "127.0.0.1")
    slots.answering(busy, now=True)
    assert not slots.take(connected()[0], "127.0.0.1")
