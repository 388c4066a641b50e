"""XML-RPC with untrusted peers: documents, a server with limits, and a call with a deadline."""

import contextlib
import socket
import threading
import time
import xmlrpc.client

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_protocol.xmlrpc.client import MOST_RESPONSE_BYTES, call
from palaestra_protocol.xmlrpc.documents import (
    UnreadableDocument,
    decode_request,
    decode_response,
    encode_fault,
    encode_request,
    encode_response,
)
from palaestra_protocol.xmlrpc.server import MOST_CONNECTIONS, MOST_REQUEST_BYTES, RpcServer

PATIENCE_S = 30.0
TEXTS = st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=5)
VALUES = st.recursive(
    st.one_of(st.booleans(), st.integers(-(2**31), 2**31 - 1), st.floats(allow_nan=False), TEXTS),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(TEXTS, inner, max_size=3)),
    max_leaves=8,
)


@given(st.lists(VALUES, max_size=3))
def test_what_is_encoded_is_decoded(values):
    """Python's own XML-RPC reader, which other programs use, returns the same values."""
    request = encode_request("name", tuple(values))

    assert decode_request(request) == ("name", tuple(values))
    assert xmlrpc.client.loads(request.decode()) == (tuple(values), "name")
    assert decode_response(encode_response(values)) == values


@given(st.binary(max_size=60))
def test_any_bytes_are_a_document_or_refused(data):
    """A caller has to catch only one error, not all errors of Python's parser."""
    for document in (data, b"<methodCall><methodName>m</methodName><params>" + data):
        with contextlib.suppress(UnreadableDocument):
            decode_request(document)


BOMB = b"""<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;">]>
<methodCall><methodName>m</methodName><params><param><value>&b;</value></param></params></methodCall>"""


@pytest.mark.parametrize(
    ("document", "fact"),
    [
        (BOMB, "a DOCTYPE"),
        (
            encode_request("m", ()).replace(b"<params>\n</params>", b"<value><array><data>" * 70),
            "nested deeper",
        ),
        (encode_response(5), "names no method"),
        (b"", "no element found"),
    ],
)
def test_a_document_that_is_no_request_is_refused_with_the_fact(document, fact):
    """Entities could expand to any size, and a deeply nested value fails when it is written again."""
    with pytest.raises(UnreadableDocument, match=fact):
        decode_request(document)


def test_a_fault_is_raised_with_its_text():
    """A program gets the same error and text from `xmlrpc.client`."""
    with pytest.raises(xmlrpc.client.Fault, match="no such call"):
        decode_response(encode_fault("no such call"))


@pytest.fixture
def server():
    """Yield a function that starts servers with the methods `double` and `nothing`."""
    made = []

    def make(**options):
        methods = {"double": lambda given: 2 * given[0], "nothing": lambda _: None}
        made.append(RpcServer(("127.0.0.1", 0), methods.get, **options))
        made[-1].start()
        return made[-1]

    yield make
    for each in made:
        each.close()


def dialed(server):
    """Return a connection to a server, with a timeout."""
    return socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S)


def uri(server):
    """Return the address of a server."""
    return f"http://127.0.0.1:{server.port}/"


def test_a_call_returns_the_value(server):
    """Both `call` and Python's client get the value.

    Python's client makes several calls over one connection.
    """
    running = server()

    assert call(uri(running), PATIENCE_S, "double", 21) == 42
    with xmlrpc.client.ServerProxy(uri(running)) as proxy:
        assert [proxy.double(each) for each in (1, "a", [2])] == [2, "aa", [2, 2]]


@pytest.mark.parametrize(("method", "given"), [("none", 1), ("double", {}), ("nothing", 0)])
def test_a_call_that_cannot_be_made_is_a_fault(server, method, given):
    """A wrong call must not end the connection, so the next call on it succeeds."""
    with xmlrpc.client.ServerProxy(uri(server())) as proxy:
        with pytest.raises(xmlrpc.client.Fault):
            getattr(proxy, method)(given)
        assert proxy.double(1) == 2


def test_several_calls_of_one_request_are_made_in_order_and_fail_alone(server):
    """A robot registers hundreds of services in one request, and one bad service must not stop the others."""
    calls = [{"methodName": name, "params": [3]} for name in ("double", "none", "system.multicall", "double")]

    with xmlrpc.client.ServerProxy(uri(server())) as proxy:
        answers = proxy.system.multicall(calls)

        assert [type(each) for each in answers] == [list, dict, dict, list]
        assert answers[0] == answers[3] == [6]
        with pytest.raises(xmlrpc.client.Fault):
            proxy.system.multicall("no list")


@pytest.mark.parametrize("request_s", [0.2, 0.0])
def test_a_request_that_is_not_finished_is_dropped(server, request_s):
    """A client that stops in the middle of a request must not occupy a thread for ever.

    With a limit of 0 s, the deadline has passed before the second read begins.
    """
    with dialed(server(request_s=request_s)) as connection:
        connection.sendall(b"POST / HTTP/1.1\r\n")

        assert connection.recv(1) == b""


def test_a_body_that_the_client_cuts_short_is_not_called():
    """A node that is killed in the middle of a call must not register half a name."""
    called = []
    with (
        RpcServer(("127.0.0.1", 0), {"note": called.append}.get) as running,
        dialed(running) as connection,
    ):
        body = encode_request("note", ("whole",))
        connection.sendall(b"POST / HTTP/1.1\r\nContent-Length: %d\r\n\r\n" % (len(body) + 1) + body)
        connection.shutdown(socket.SHUT_WR)

        assert connection.recv(1) == b""
    assert called == []


def test_a_connection_without_a_request_is_dropped(server):
    """The server also closes a connection that a client has forgotten to close."""
    with dialed(server(idle_s=0.2)) as connection:
        assert connection.recv(1) == b""


def test_a_body_that_is_too_long_or_has_no_length_is_refused(server):
    """The server responds before it reads any of the body, so a huge body takes no memory."""
    for header, status in ((f"Content-Length: {MOST_REQUEST_BYTES + 1}", b"413"), ("X: y", b"411")):
        with dialed(server()) as connection:
            connection.sendall(f"POST / HTTP/1.1\r\n{header}\r\n\r\n".encode())
            answer = connection.recv(65536)

            assert answer.split()[1] == status


def test_a_server_that_is_closed_closes_its_connections(server):
    """A node that has ended must not respond to calls as if it still ran."""
    running = server()
    with dialed(running) as connection:
        call(uri(running), PATIENCE_S, "double", 1)

        running.close()

        assert connection.recv(1) == b""


def test_a_new_connection_takes_the_place_of_an_idle_one(server):
    """Connections that clients forgot to close must not keep a simulator from registering."""
    running = server()
    with contextlib.ExitStack() as opened:
        idle = [opened.enter_context(dialed(running)) for _ in range(MOST_CONNECTIONS + 8)]

        assert call(uri(running), PATIENCE_S, "double", 2) == 4
        assert [connection.recv(1) for connection in idle[:8]] == [b""] * 8


@pytest.fixture
def peer():
    """`peer(pieces)` returns the address of a program that answers with these pieces and then waits."""
    ended = threading.Event()
    begun = []

    def begin(pieces, pace_s=0.0):
        listening = socket.create_server(("127.0.0.1", 0))

        def answer():
            with contextlib.suppress(OSError):
                connection, _ = listening.accept()
                with connection:
                    for piece in pieces:
                        connection.sendall(piece)
                        ended.wait(pace_s)
                    ended.wait(PATIENCE_S)

        thread = threading.Thread(target=answer, daemon=True)
        thread.start()
        begun.append((listening, thread))
        return f"http://127.0.0.1:{listening.getsockname()[1]}/"

    yield begin
    ended.set()
    for listening, thread in begun:
        listening.shutdown(socket.SHUT_RDWR)  # a thread that still waits for a connection ends
        thread.join(PATIENCE_S)
        listening.close()


HEAD = b"HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\n"


@pytest.mark.parametrize("pieces", [[], [b"H"] * 1000, [HEAD, b"\r\n", *[b" "] * 1000]])
def test_a_call_ends_at_its_deadline_however_slowly_the_answer_comes(peer, pieces):
    """A byte now and then would renew a socket's timeout, so the call has a deadline."""
    began = time.monotonic()

    with pytest.raises(TimeoutError):
        call(peer(pieces, pace_s=0.05), 0.3, "m")

    assert time.monotonic() - began < PATIENCE_S


def test_the_deadline_of_a_call_includes_the_time_to_write_its_parameters(peer):
    """A caller that stops at a deadline counts from the call, not from the first byte that is sent."""
    with pytest.raises(TimeoutError):
        call(peer([]), 0.02, "m", list(range(100_000)))


@pytest.mark.parametrize(
    "answer",
    [
        b"no HTTP\r\n\r\n",
        b"HTTP/1.1 500 Oops\r\nContent-Length: 0\r\n\r\n",
        HEAD + b"Content-Length: 3\r\n\r\nabc",
        HEAD + b"Content-Length: %d\r\n\r\n" % (2 * MOST_RESPONSE_BYTES) + bytes(2 * MOST_RESPONSE_BYTES),
    ],
)
def test_an_answer_that_is_no_response_is_refused(peer, answer):
    """A caller then has to catch only one error, whatever is wrong with the response."""
    with pytest.raises(UnreadableDocument):
        call(peer([answer]), PATIENCE_S, "m")


LONG = f"http://{'h' * 64}.org:1/"  # a label of a host name has at most 63 characters


@pytest.mark.parametrize(
    "address", ["http://", "rosrpc://h:1", "http://h:x/", "http://h/", "http://ä:1/", LONG]
)
def test_an_address_that_is_none_is_refused(address):
    """A node may register any text as its address."""
    with pytest.raises(UnreadableDocument, match="is not an address"):
        call(address, PATIENCE_S, "m")
