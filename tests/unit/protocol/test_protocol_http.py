"""The server of operator, trainer and sidecar: what it answers, and its bounds."""

import json
import logging
import socket
import time
from functools import partial
from http import HTTPStatus

import pytest

from palaestra_protocol.http import (
    MOST_BODY_BYTES,
    MOST_CONNECTIONS,
    MOST_REQUEST_BYTES,
    Address,
    Response,
    Server,
    json_response,
    probe_response,
)
from tests.waiting import eventually

LOOPBACK = Address("127.0.0.1", 0)
DEADLINE_S = 0.5


def echo(body):
    """Return what was sent."""
    return Response(status=HTTPStatus.OK, body=body, content_type="text/plain")


def fails(_):
    """Raise what only a mistake in a route raises."""
    raise RuntimeError("no such attribute")


ROUTES = {
    ("GET", "/healthz"): lambda _: probe_response(),
    ("GET", "/readyz"): lambda _: probe_response("not read yet: pods"),
    ("GET", "/status"): lambda _: json_response(HTTPStatus.OK, {"step": 7}),
    ("GET", "/wrong"): fails,
    ("POST", "/echo"): echo,
}


@pytest.fixture
def server():
    """A server with the usual bounds."""
    with Server(LOOPBACK, ROUTES, name="palaestra-test") as server:
        yield server


def connect(server):
    """Return a connection to the server."""
    return socket.create_connection(server.address, 10)


def ask(server, request):
    """Return the answer to bytes that need not be HTTP: status, head, body; None: closed unanswered."""
    with connect(server) as connection:
        try:
            connection.sendall(request)
            answer = connection.makefile("rb").read().decode()
        except ConnectionError:
            answer = ""
    if not answer:
        return None
    head, _, body = answer.partition("\r\n\r\n")
    return int(head.split()[1]), head, body


def is_closed(connection, piece):
    """Send a piece more, and return whether the server has closed the connection."""
    try:
        connection.sendall(piece)
        return connection.recv(1) == b""
    except TimeoutError:
        return False
    except ConnectionError:
        return True


@pytest.mark.parametrize(
    ("request_", "status", "content_type", "body"),
    [
        (b"GET /healthz HTTP/1.1\r\n\r\n", 200, "text/plain; charset=utf-8", "ok\n"),
        (b"GET /healthz?verbose HTTP/1.1\r\n\r\n", 200, "text/plain; charset=utf-8", "ok\n"),
        (b"GET /readyz HTTP/1.1\r\n\r\n", 503, "text/plain; charset=utf-8", "not read yet: pods\n"),
        (b"GET /status HTTP/1.0\r\n\r\n", 200, "application/json", '{"step": 7}\n'),
        (b"POST /echo HTTP/1.1\r\nContent-Length: 2\r\n\r\nabc", 200, "text/plain", "ab"),
    ],
)
def test_a_route_answers(server, request_, status, content_type, body) -> None:
    """The head says how long the body is, and what sort of program serves."""
    answered, head, text = ask(server, request_)

    assert (answered, text) == (status, body)
    assert f"Content-Type: {content_type}" in head
    assert f"Content-Length: {len(body)}" in head
    assert "Server: palaestra-test\r\n" in head


@pytest.mark.parametrize(
    ("request_", "status", "error"),
    [
        (
            b"GET /etc/passwd HTTP/1.1\r\n\r\n",
            404,
            "path: is not one of /echo, /healthz, /readyz, /status, /wrong",
        ),
        (b"GET /echo HTTP/1.1\r\n\r\n", 405, "/echo: does not take GET"),
        (
            b"POST /healthz HTTP/1.1\r\nContent-Length: 0\r\n\r\n",
            405,
            "/healthz: does not take POST",
        ),
        (b"POST /echo HTTP/1.1\r\n\r\n", 411, "Content-Length: is missing"),
        (
            b"POST /echo HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n",
            411,
            "Content-Length: is missing",
        ),
        (
            b"POST /echo HTTP/1.1\r\nContent-Length: %d\r\n\r\n" % (MOST_BODY_BYTES + 1),
            413,
            f"body: more than {MOST_BODY_BYTES} bytes",
        ),
        (
            b"POST /echo HTTP/1.1\r\nContent-Length: " + b"9" * 5000 + b"\r\n\r\n",
            413,
            f"body: more than {MOST_BODY_BYTES} bytes",
        ),
    ],
)
def test_a_refusal_names_field_and_fact(server, request_, status, error) -> None:
    """Programs read the status, people the sentence."""
    answered, _, body = ask(server, request_)

    assert (answered, json.loads(body)) == (status, {"error": error})


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (b"HEAD /healthz HTTP/1.1\r\n\r\n", 501),
        (b"DELETE /healthz HTTP/1.1\r\n\r\n", 501),
        (b"GET /" + b"x" * 70_000 + b" HTTP/1.1\r\n\r\n", 414),
        (b"GET /healthz HTTP/1.1\r\n" + b"X: y\r\n" * 101 + b"\r\n", 431),
    ],
)
def test_other_methods_and_heads_that_are_too_long_are_refused(server, request_, status) -> None:
    """By http.server itself."""
    with connect(server) as connection:
        connection.sendall(request_)
        assert connection.makefile("rb").readline().split()[1] == str(status).encode()


@pytest.mark.parametrize("piece", [b"", b"x"], ids=["silent", "slow"])
def test_a_request_that_is_not_complete_at_its_deadline_is_closed_unanswered(piece) -> None:
    """One byte now and then does not keep a place."""
    short = Server(LOOPBACK, ROUTES, name="palaestra-test", deadline_s=DEADLINE_S)
    with short as server, connect(server) as connection:
        begin = time.monotonic()
        connection.settimeout(0.05)
        connection.sendall(b"GET /healthz")
        assert eventually(partial(is_closed, connection, piece), pace_s=0)

    assert time.monotonic() >= begin + DEADLINE_S * 0.9


def test_a_head_without_end_is_closed_unanswered(server) -> None:
    """Each line and their number are bounded, and all of them together."""
    lines = b"".join(b"X-%d: %s\r\n" % (number, b"x" * 50_000) for number in range(10))
    assert len(lines) > MOST_REQUEST_BYTES

    assert ask(server, b"GET /healthz HTTP/1.1\r\n" + lines) is None


def test_connections_beyond_the_bound_are_closed_and_the_others_keep_their_place() -> None:
    """A place is free again when its connection ends."""
    with Server(LOOPBACK, ROUTES, name="palaestra-test", deadline_s=60.0) as server:
        kept = [connect(server) for _ in range(MOST_CONNECTIONS)]
        with connect(server) as refused:
            assert refused.recv(1) == b""

        kept[0].sendall(b"GET /healthz HTTP/1.1\r\n\r\n")
        assert b"200" in kept[0].makefile("rb").readline()
        kept[1].close()
        assert eventually(lambda: ask(server, b"GET /healthz HTTP/1.1\r\n\r\n"))
        for connection in kept:
            connection.close()


def test_an_error_of_a_route_is_logged_and_the_server_goes_on(server, caplog) -> None:
    """A client that goes away is no error."""
    with caplog.at_level(logging.ERROR):
        assert ask(server, b"GET /wrong HTTP/1.1\r\n\r\n") is None
        assert ask(server, b"GET /healthz HTTP/1.1\r\n\r\n")[0] == 200

    (record,) = caplog.records
    assert record.getMessage() == "palaestra-test: a request failed: RuntimeError('no such attribute')"


def test_a_closed_server_frees_its_address() -> None:
    """Also one that was never started."""
    server = Server(LOOPBACK, ROUTES, name="palaestra-test")
    address = server.address
    with pytest.raises(OSError, match="Address already in use"):
        Server(address, ROUTES, name="palaestra-test")
    server.close()

    with Server(address, ROUTES, name="palaestra-test") as other:
        assert other.address == address
    with Server(address, ROUTES, name="palaestra-test") as another:
        assert ask(another, b"GET /healthz HTTP/1.1\r\n\r\n")[0] == 200
