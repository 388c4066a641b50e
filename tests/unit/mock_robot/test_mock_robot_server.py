"""The HTTP server of a mock robot: its responses, and the requests that it refuses."""

import json
import socket
import time

import pytest

from palaestra_protocol.http import Address
from palaestra_sim.mock_robot.server import MOST_BODY_BYTES, BadRequestError, RestServer

PATIENCE_S = 30.0


def drive(body):
    """Accept a JSON list, as a robot's route for velocities does."""
    if not body.startswith(b"["):
        raise BadRequestError("body: is not a list; send [vx, vy, omega]")


ROUTES = {
    ("GET", "/distances"): lambda _: [0.4, 0.2],
    ("GET", "/camera"): lambda _: b"\xff\xd8picture",
    ("PUT", "/velocity"): drive,
    ("POST", "/echo"): lambda body: {"size": len(body)},
}


@pytest.fixture
def server():
    """Yield a function that starts a server; each response waits for `wait_s`."""
    made = []

    def start(wait_s=0.0, host="127.0.0.1"):
        made.append(RestServer(Address(host, 0), ROUTES, lambda _: wait_s))
        made[-1].start()
        return made[-1]

    yield start
    for each in made:
        each.close()


def asked(server, head, body=b"", *, ends=False):
    """Send a request; return the status, the headers and the body of the response."""
    with socket.create_connection(server.address, timeout=PATIENCE_S) as connection:
        connection.sendall(f"{head}\r\n\r\n".encode() + body)
        if ends:
            connection.shutdown(socket.SHUT_WR)
        file = connection.makefile("rb")
        line = file.readline()
        if not line:
            return None
        headers = dict(each.split(b": ", 1) for each in iter(lambda: file.readline().strip(), b""))
        content = file.read(int(headers[b"Content-Length"]))
        if headers.get(b"Connection") == b"close":
            assert file.read() == b""
        return int(line.split()[1]), headers, content


@pytest.mark.parametrize(
    ("head", "body", "type_", "content"),
    [
        ("GET /distances HTTP/1.1", b"", b"application/json", b"[0.4, 0.2]"),
        ("GET /distances?fresh=1 HTTP/1.1", b"", b"application/json", b"[0.4, 0.2]"),
        ("GET /camera HTTP/1.1", b"", b"image/jpeg", b"\xff\xd8picture"),
        ("PUT /velocity HTTP/1.1\r\nContent-Length: 9", b"[0, 0, 1]", b"application/json", b""),
        ("POST /echo HTTP/1.1\r\nContent-Length: 3", b"abc", b"application/json", b'{"size": 3}'),
    ],
)
def test_a_route_is_answered_with_its_content(server, head, body, type_, content) -> None:
    """A robot sends JSON, pictures, or nothing."""
    status, headers, found = asked(server(), head, body)

    assert (status, headers[b"Content-Type"], found) == (200, type_, content)


@pytest.mark.parametrize(
    ("head", "body", "status", "fact"),
    [
        ("GET /nothing HTTP/1.1", b"", 404, "/nothing: is unknown"),
        ("GET /velocity HTTP/1.1", b"", 405, "/velocity: does not accept GET"),
        (
            "PUT /velocity HTTP/1.1\r\nContent-Length: 1",
            b"1",
            400,
            "body: is not a list; send [vx, vy, omega]",
        ),
        ("PUT /velocity HTTP/1.1", b"", 411, "Content-Length: is missing; give the length of the body"),
        ("PUT /velocity HTTP/1.1\r\nContent-Length: -1", b"", 411, "Content-Length: is missing"),
        (f"POST /echo HTTP/1.1\r\nContent-Length: {MOST_BODY_BYTES + 1}", b"", 413, "send a shorter body"),
        (f"POST /echo HTTP/1.1\r\nContent-Length: {'9' * 4000}", b"", 413, "send a shorter body"),
    ],
)
def test_a_refusal_has_the_fact_and_the_remedy(server, head, body, status, fact) -> None:
    """A person who tries the interface with curl sees what to change."""
    found, _, content = asked(server(), head, body)

    assert found == status
    assert fact in json.loads(content)["error"]


def test_a_body_that_is_cut_short_is_not_obeyed(server) -> None:
    """The missing part of the body could change the command, for example to a stop."""
    head = "PUT /velocity HTTP/1.1\r\nContent-Length: 10"

    assert asked(server(), head, b"[9, 9", ends=True) is None


def test_a_response_comes_late_by_the_given_time(server) -> None:
    """A real robot responds after tens of milliseconds, so the mock must be able to delay its responses."""
    begun = time.monotonic()

    status, _, _ = asked(server(wait_s=0.2), "GET /distances HTTP/1.1")

    assert status == 200
    assert time.monotonic() - begun >= 0.2


def test_a_server_on_ipv6_names_its_address(server) -> None:
    """The port is the one that the system chose."""
    running = server(host="::1")

    assert running.address == Address("::1", running.port)
    assert asked(running, "GET /distances HTTP/1.1")[0] == 200
