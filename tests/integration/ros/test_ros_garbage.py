"""A server that sends wrong XML-RPC responses causes a fault of one simulator, and nothing worse."""

import queue
import socketserver
import threading
import tracemalloc
import xmlrpc.client

import pytest

from palaestra_trainer.errors import MasterLost, SimulatorHung, WrongData
from palaestra_trainer.ros import Master, RosService, RosSubscriber, ensure_node
from palaestra_trainer.ros.tcpros_client import TcprosClient

DEADLINE_S = 60.0  # the waits take moments on an idle machine
HTTP = b"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\n\r\n"
WHOLE = xmlrpc.client.dumps(([1, "", "rosrpc://localhost:1"],), methodresponse=True).encode()


def answered(value):
    """Return a correct XML-RPC response."""
    return HTTP + xmlrpc.client.dumps((value,), methodresponse=True).encode()


GARBAGE = {
    "no HTTP": b"\x00\xff\x00garbage\r\n\r\n",
    "nothing": HTTP,
    "garbage": HTTP + b"\x00\xffgarbage",
    "another document": HTTP + b"<html><body>nginx</body></html>",
    "half an answer": HTTP + WHOLE[: len(WHOLE) // 2],
    "no parameters": HTTP + b"<methodResponse><params></params></methodResponse>",
    "a broken number": HTTP + WHOLE.replace(b"<int>1</int>", b"<int>one</int>"),
    "an unknown encoding": HTTP + b"<?xml version='1.0' encoding='no-such'?>" + WHOLE,
    "a list that was never begun": HTTP + WHOLE.replace(b"<array><data>", b""),
    "a refusal by HTTP": b"HTTP/1.0 500 Oops\r\n\r\n",
    "a number": answered(7),
    "two values": answered([1, ""]),
    "a code that is text": answered(["1", "", ""]),
    "a value of another kind": answered([1, "", 7]),
    "an address without a port number": answered([1, "", "rosrpc://localhost:x"]),
}


@pytest.fixture
def server():
    """Yield a function that starts a server with this response to every client and returns its address."""
    servers = []

    def begin(answer):
        class Handler(socketserver.BaseRequestHandler):
            def handle(self):
                self.request.recv(65536)
                self.request.sendall(answer)

        listening = socketserver.ThreadingTCPServer(("127.0.0.1", 0), Handler)
        servers.append(listening)
        threading.Thread(target=listening.serve_forever, args=(0.01,), daemon=True).start()
        return f"http://127.0.0.1:{listening.server_address[1]}/"

    yield begin
    for listening in servers:
        listening.shutdown()
        listening.server_close()


@pytest.mark.parametrize("answer", GARBAGE.values(), ids=GARBAGE.keys())
def test_a_master_that_answers_garbage_is_a_fault_of_the_simulator_that_was_asked_for(
    master, server, monkeypatch, answer
):
    """The fault is counted and training continues, because the next response may be correct."""
    del master
    ensure_node()
    monkeypatch.setenv("ROS_MASTER_URI", server(answer))

    with pytest.raises(
        WrongData, match=r"robotino: /robotino/robot/get_time cannot be looked up: .*responded"
    ):
        RosService("/robotino/robot/get_time", "webots_ros/get_float")(ask=True)
    with pytest.raises(WrongData, match="robotino: /robotino/ir1/value cannot be subscribed to: "):
        RosSubscriber("/robotino/ir1/value", "sensor_msgs/Range").connect()


@pytest.mark.parametrize("answer", GARBAGE.values(), ids=GARBAGE.keys())
def test_a_publisher_that_answers_garbage_is_a_fault_of_its_simulator(master, server, answer):
    """The publisher is the node of one simulator, so only that simulator has the fault."""
    ensure_node()
    topic = f"/garbage/{threading.get_ident()}_{abs(hash(answer))}/value"
    with xmlrpc.client.ServerProxy(master) as ask_master:
        ask_master.registerPublisher("/garbage", topic, "sensor_msgs/Range", server(answer))
    subscriber = RosSubscriber(topic, "sensor_msgs/Range")

    with pytest.raises(WrongData, match="garbage: "):
        subscriber.connect()
    subscriber.close()


def test_a_program_that_is_no_master_is_reported_as_a_lost_master(server, monkeypatch):
    """A program starts a master if none responds, but here another program uses the master's address."""
    monkeypatch.setenv("ROS_MASTER_URI", server(GARBAGE["another document"]))

    with pytest.raises(MasterLost, match="another program may use this address"):
        Master("/test").ping()


@pytest.fixture
def connected():
    """Yield a function that connects a client with a timeout, and returns it with the peer's socket."""
    peers = queue.Queue()
    wires = []

    class Handler(socketserver.BaseRequestHandler):
        def handle(self):
            self.request.recv(65536)
            self.request.sendall(b"\x00\x00\x00\x00")
            peers.put(self.request)
            ended.wait()

    ended = threading.Event()
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Handler) as listening:
        listening.daemon_threads = True
        threading.Thread(target=listening.serve_forever, args=(0.01,), daemon=True).start()

        def connect(deadline_s):
            wires.append(
                TcprosClient(listening.server_address, {"callerid": "/test"}, "robotino", deadline_s)
            )
            return wires[-1], peers.get(timeout=DEADLINE_S)

        yield connect
        for wire in wires:
            wire.close()
        ended.set()
        listening.shutdown()


def test_the_memory_for_a_frame_grows_with_what_arrives_of_it(connected):
    """Four wrong bytes may announce a frame of 64 MiB, which must not be allocated at once."""
    wire, peer = connected(0.2)
    peer.sendall((64 << 20).to_bytes(4, "little") + bytes(1000))

    tracemalloc.start()
    try:
        with pytest.raises(SimulatorHung):
            wire.receive()
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()

    assert peak < 1 << 20


def test_the_memory_of_a_long_frame_is_given_back_once_it_is_read(connected):
    """After one long message, the connection must not hold a buffer of that length forever."""
    wire, peer = connected(DEADLINE_S)
    length = 16 << 20
    tracemalloc.start()
    try:
        sending = threading.Thread(
            target=peer.sendall, args=(length.to_bytes(4, "little") + bytes(length),), daemon=True
        )
        sending.start()
        assert len(wire.receive()) == length
        sending.join()
        del sending
        left, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert left < 1 << 20
