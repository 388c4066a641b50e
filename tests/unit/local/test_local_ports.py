"""Free ports that stay reserved until their container listens."""

import http.server
import socket

import pytest

from palaestra.local.errors import RunRefused
from palaestra.local.ports import HeldPorts


def test_ports_differ_from_one_another():
    """If ports were chosen and released one by one, two could be equal."""
    with HeldPorts() as held:
        ports = [held.any() for _ in range(50)]

    assert len(set(ports)) == 50


def test_a_held_port_is_for_its_container_and_nobody_else():
    """A server with SO_REUSEADDR can bind to the port, as Palaestra's do. A program without it cannot."""
    with HeldPorts() as held:
        port = held.any()

        with pytest.raises(OSError, match="in use"), socket.socket() as stranger:
            stranger.bind(("127.0.0.1", port))
        http.server.ThreadingHTTPServer(
            ("127.0.0.1", port), http.server.BaseHTTPRequestHandler
        ).server_close()


def test_a_held_port_can_be_listened_on_again_after_a_restart():
    """A sidecar that crashed listens on the same port again."""
    with HeldPorts() as held:
        port = held.any()
        for _ in range(3):
            server = socket.create_server(("127.0.0.1", port))
            client = socket.create_connection(("127.0.0.1", port))
            server.accept()[0].close()
            client.close()
            server.close()


def test_a_port_in_use_is_refused_with_a_remedy():
    """The error comes before anything is started."""
    with socket.create_server(("127.0.0.1", 0)) as server, HeldPorts() as held:
        port = server.getsockname()[1]

        with pytest.raises(RunRefused, match=rf"^port {port}: .*in use.*--ros-port"):
            held.this(port)
