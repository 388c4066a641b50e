"""The HTTP server of operator, trainer and sidecar: its responses and its limits."""

import contextlib
import json
import logging
import socket
import threading
import time
from functools import partial
from http import HTTPStatus

import pytest

from palaestra_protocol.connection_limits import MOST_OF_PEER
from palaestra_protocol.http import (
    MOST_BODY_BYTES,
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
    """Return the body of the request as the response."""
    return Response(status=HTTPStatus.OK, body=body, content_type="text/plain")


def fails(_):
    """Raise an error, as a route with a bug would."""
    raise RuntimeError("no such attribute")


ROUTES = {
    ("GET", "/healthz"): lambda _: probe_response(),
    ("GET", "/readyz"): lambda _: probe_response("not read yet: pods"),
    ("GET", "/status"): lambda _: json_response(HTTPStatus.OK, {"step": 7}),
    ("GET", "/wrong"): fails,
    ("POST", "/echo"): echo,
}


EVERY = Address("0.0.0.0", 0)


def peered(host, server):
    """Return a connection to the server through another address of this machine."""
    return socket.create_connection((host, server.address.port), timeout=DEADLINE_S)


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
@pytest.mark.parametrize("peer", ["127.0.0.1", "::1"])
def test_every_address_is_one_of_ipv6_and_of_ipv4(host, peer):
    """In a cluster with only IPv6, the kubelet's probes failed because the server listened only on IPv4."""
    with Server(Address(host, 0), ROUTES, name="test") as listening, peered(peer, listening) as connection:
        connection.sendall(b"GET /healthz HTTP/1.0\r\n\r\n")
        answer = connection.makefile("rb").read()

    assert answer.endswith(b"ok\n")


def test_a_node_without_ipv6_listens_on_ipv4(monkeypatch):
    """With the kernel option `ipv6.disable=1`, no IPv6 socket can be created."""
    monkeypatch.setattr(socket, "has_dualstack_ipv6", lambda: False)

    with Server(EVERY, ROUTES, name="test") as listening:
        assert listening.address.host == "0.0.0.0"


@pytest.fixture
def server():
    """Yield a server with the default limits."""
    with Server(LOOPBACK, ROUTES, name="palaestra-test") as server:
        yield server


def connect(server):
    """Return a connection to the server."""
    return socket.create_connection(server.address, 10)


def ask(server, request):
    """Return the status, head and body of the response, or None if the server closed the connection."""
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
    """Send another piece of a request, and return whether the server has closed the connection."""
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
    """A client needs the length in the head, because it reads that many bytes as the body."""
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
        (b"GET /echo HTTP/1.1\r\n\r\n", 405, "/echo: does not accept GET"),
        (
            b"POST /healthz HTTP/1.1\r\nContent-Length: 0\r\n\r\n",
            405,
            "/healthz: does not accept POST",
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
    """A program reads the status of the error response, and a person reads its sentence."""
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
    """The base class in http.server sends these error responses itself."""
    with connect(server) as connection:
        connection.sendall(request_)
        assert connection.makefile("rb").readline().split()[1] == str(status).encode()


@pytest.mark.parametrize("piece", [b"", b"x"], ids=["silent", "slow"])
def test_a_request_that_is_not_complete_at_its_deadline_is_closed_unanswered(piece) -> None:
    """A client that sends a byte now and then must not occupy a connection for ever."""
    short = Server(LOOPBACK, ROUTES, name="palaestra-test", deadline_s=DEADLINE_S)
    with short as server, connect(server) as connection:
        begin = time.monotonic()
        connection.settimeout(0.05)
        connection.sendall(b"GET /healthz")
        assert eventually(partial(is_closed, connection, piece), pace_s=0)

    assert time.monotonic() >= begin + DEADLINE_S * 0.9


def test_a_deadline_that_has_passed_closes_the_connection_before_a_read() -> None:
    """A busy machine may start the thread of a connection late, and a timeout of 0 s means no waiting."""
    with Server(LOOPBACK, ROUTES, name="palaestra-test", deadline_s=0.0) as server:
        assert ask(server, b"GET /healthz HTTP/1.1\r\n\r\n") is None


def test_a_head_without_end_is_closed_unanswered(server) -> None:
    """No line is too long and the lines are few, so only the limit of the whole head protects the memory."""
    lines = b"".join(b"X-%d: %s\r\n" % (number, b"x" * 50_000) for number in range(10))
    assert len(lines) > MOST_REQUEST_BYTES

    assert ask(server, b"GET /healthz HTTP/1.1\r\n" + lines) is None


REQUEST = b"GET /healthz HTTP/1.1\r\n\r\n"


@contextlib.contextmanager
def half_open(server, count, host="127.0.0.1"):
    """Yield connections of one client, each with a request that has begun and does not end."""
    with contextlib.ExitStack() as stack:
        kept = [
            stack.enter_context(socket.create_connection(server.address, source_address=(host, 0)))
            for _ in range(count)
        ]
        for connection in kept:
            connection.settimeout(60.0)
            # The server may have closed this connection in favor of a newer one.
            with contextlib.suppress(OSError):
                connection.sendall(REQUEST[:9])
        yield kept


def test_a_probe_is_answered_while_others_keep_half_open_connections() -> None:
    """Without a limit for each client, half-open connections of a few clients would block every probe.

    A kubelet restarts a container that fails its probes.
    """
    with Server(LOOPBACK, ROUTES, name="palaestra-test", deadline_s=60.0) as server:
        for host in ("127.0.0.1", "127.0.0.2", "127.0.0.3"):
            with half_open(server, 2 * MOST_OF_PEER, host):
                assert [ask(server, REQUEST)[0] for _ in range(5)] == [200] * 5


def test_a_peer_with_many_connections_takes_no_place_of_another() -> None:
    """The server closes the oldest connection of the same client.

    A request of another client still gets its response.
    """
    with (
        Server(LOOPBACK, ROUTES, name="palaestra-test", deadline_s=60.0) as server,
        half_open(server, 1, "127.0.0.2") as [other],
        half_open(server, MOST_OF_PEER + 1) as [first, *rest],
    ):
        assert first.recv(1) == b""

        for connection in (other, rest[-1]):
            connection.sendall(REQUEST[9:])
            assert b"200" in connection.makefile("rb").readline()


def test_a_connection_whose_request_is_answered_keeps_its_place() -> None:
    """A request in progress must not be lost, so the server closes the client's newest connection."""
    begun, going_on = threading.Semaphore(0), threading.Event()

    def answer(_):
        begun.release()
        assert going_on.wait(60.0)
        return probe_response()

    slow = {("GET", "/healthz"): answer}
    with (
        Server(LOOPBACK, slow, name="palaestra-test", deadline_s=60.0) as server,
        contextlib.ExitStack() as stack,
    ):
        asking = [stack.enter_context(connect(server)) for _ in range(MOST_OF_PEER)]
        for connection in asking:
            connection.sendall(REQUEST)
            assert begun.acquire(timeout=60.0)
        assert ask(server, REQUEST) is None
        going_on.set()

        assert all(b"200" in connection.makefile("rb").readline() for connection in asking)


def test_an_error_of_a_route_is_logged_and_the_server_goes_on(server, caplog) -> None:
    """A person finds the error in the log, and one broken route must not stop the probes."""
    with caplog.at_level(logging.ERROR):
        assert ask(server, b"GET /wrong HTTP/1.1\r\n\r\n") is None
        assert ask(server, b"GET /healthz HTTP/1.1\r\n\r\n")[0] == 200

    (record,) = caplog.records
    assert record.getMessage() == "palaestra-test: a request failed: RuntimeError('no such attribute')"


def test_a_closed_server_frees_its_address() -> None:
    """A new server must be able to use the address, even if the closed server was never started."""
    server = Server(LOOPBACK, ROUTES, name="palaestra-test")
    address = server.address
    with pytest.raises(OSError, match="Address already in use"):
        Server(address, ROUTES, name="palaestra-test")
    server.close()

    with Server(address, ROUTES, name="palaestra-test") as other:
        assert other.address == address
    with Server(address, ROUTES, name="palaestra-test") as another:
        assert ask(another, b"GET /healthz HTTP/1.1\r\n\r\n")[0] == 200
