"""Free ports that stay reserved until their container listens."""

import http.server
import socket

import pytest

from palaestra.local.errors import RunRefused
from palaestra.local.ports import HeldPorts


def test_ports_differ_from_one_another():
    """If each port were released before the next is chosen, two ports could be equal."""
    with HeldPorts() as held:
        ports = [held.any() for _ in range(50)]

    assert len(set(ports)) == 50


def test_a_held_port_is_for_its_container_and_nobody_else():
    """Palaestra's servers set SO_REUSEADDR and can bind the held port.

    A program without this option cannot.
    """
    with HeldPorts() as held:
        port = held.any()

        with pytest.raises(OSError, match="in use"), socket.socket() as stranger:
            stranger.bind(("127.0.0.1", port))
        http.server.ThreadingHTTPServer(
            ("127.0.0.1", port), http.server.BaseHTTPRequestHandler
        ).server_close()


def test_a_held_port_can_be_listened_on_again_after_a_restart():
    """A sidecar that restarts after a crash listens on the same port."""
    with HeldPorts() as held:
        port = held.any()
        for _ in range(3):
            server = socket.create_server(("127.0.0.1", port))
            client = socket.create_connection(("127.0.0.1", port))
            server.accept()[0].close()
            client.close()
            server.close()


def test_a_port_in_use_is_refused_with_a_remedy():
    """The error comes before the run starts a process."""
    with socket.create_server(("127.0.0.1", 0)) as server, HeldPorts() as held:
        port = server.getsockname()[1]

        with pytest.raises(RunRefused, match=rf"^port {port}: .*in use.*--ros-port"):
            held.this(port)
