"""The node of the stub, with connections like those of other projects' programs."""

import gc
import os
import socket
import struct
import threading
import xmlrpc.client

import pytest

from palaestra_protocol.ros.rostypes import message_type, service_type
from palaestra_protocol.ros.tcpros import FrameReader, decode_header, encode_header, frame
from palaestra_sim.ros import LATER, links
from palaestra_trainer.ros import Master
from tests.integration.ros.conftest import DEADLINE_S
from tests.waiting import eventually

ASK = b"\x01"
LONG_TEXT = "x" * 20_000_000  # longer than the buffers of a connection


@pytest.fixture
def dial(peer):
    """Yield a function that opens TCPROS connections to the peer.

    The function sends a header, and returns the socket and the header of the response.
    """
    opened = []

    def connect(**header):
        address = Master("/raw").service_address(f"/{peer.name}/double")
        connection = socket.create_connection(address, timeout=5)
        opened.append(connection)
        connection.sendall(encode_header({"callerid": "/raw", **header}))
        return connection, decode_header(read_frame(connection))

    yield connect
    for connection in opened:
        connection.close()


def read_exactly(connection, count):
    """Receive and return this many bytes."""
    data = b""
    while len(data) < count:
        piece = connection.recv(count - len(data))
        assert piece, "the peer closed the connection"
        data += piece
    return data


def read_frame(connection):
    """Receive one frame, and return its payload."""
    return read_exactly(connection, struct.unpack("<I", read_exactly(connection, 4))[0])


def service_header(peer, path, type_name, **more):
    """Return the header that a client of a service sends."""
    return {"service": f"/{peer.name}/{path}", "md5sum": service_type(type_name).md5, **more}


def slave_api(peer):
    """Return the XML-RPC interface of the peer at the address that the master lists."""
    with xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        return xmlrpc.client.ServerProxy(master.lookupNode("/raw", f"/{peer.name}")[2])


def test_the_answer_header_tells_the_type(peer, dial):
    """`rosservice type` reads the type from the header of the response."""
    _, header = dial(**service_header(peer, "double", "webots_ros/set_float"))

    assert header["type"] == "webots_ros/set_float"
    assert header["callerid"] == f"/{peer.name}"


# The md5 sum of `uint64 node; string fieldName; bool queryBaseNode --- uint64 field`, the type in Webots
# R2025a.
GET_FIELD_2025A = "88d5309880e1463a89aff87d30e09f1c"


def test_a_client_of_webots_r2025a_is_served_too(peer, dial):
    """Webots R2025a renamed a field of three requests; their md5 sums changed, but not their bytes."""
    peer.do(
        lambda: peer.node.serve(
            "field", "webots_ros/node_get_field", lambda it: {"field": it.node + it.proto}
        )
    )

    connection, header = dial(service=f"/{peer.name}/field", md5sum=GET_FIELD_2025A)
    connection.sendall(frame(struct.pack("<QI5sB", 6, 5, b"title", True)))

    assert header["md5sum"] == GET_FIELD_2025A
    assert (read_exactly(connection, 1), read_frame(connection)) == (b"\x01", struct.pack("<Q", 7))


def test_a_client_that_does_not_ask_for_more_is_hung_up_on(peer, dial):
    """Without the header field `persistent`, a connection serves only one call."""
    connection, _ = dial(**service_header(peer, "get_time", "webots_ros/get_float"))
    connection.sendall(frame(ASK) * 2)

    assert read_exactly(connection, 1) == b"\x01"
    assert struct.unpack("<d", read_frame(connection)) == (1.25,)
    assert connection.recv(1) == b""


def test_a_client_hangs_up_before_the_node_does(peer, dial, monkeypatch):
    """When a server closes first, roscpp drops a response that it has not read (ros/ros_comm#1976)."""
    monkeypatch.setattr(links, "LINGER_S", DEADLINE_S)
    connection, _ = dial(**service_header(peer, "get_time", "webots_ros/get_float"))
    connection.sendall(frame(ASK))
    read_exactly(connection, 1)
    read_frame(connection)
    peer.do(lambda: None)  # wait until the node has finished all work after the response

    connection.setblocking(False)
    with pytest.raises(BlockingIOError):
        connection.recv(1)


@pytest.fixture
def ask_for_much(peer, dial, monkeypatch):
    """Return a function that requests a long response and returns the connection after its first byte.

    The response does not fit into the buffers of the connection.
    """
    monkeypatch.setattr(links, "LINGER_S", 0.01)
    peer.do(lambda: peer.node.serve("get_text", "webots_ros/get_string", lambda _: {"value": LONG_TEXT}))
    connection, _ = dial(**service_header(peer, "get_text", "webots_ros/get_string"))

    def ask():
        connection.sendall(frame(ASK))
        assert read_exactly(connection, 1) == b"\x01"
        return connection

    return ask


def test_an_answer_that_the_socket_cannot_take_at_once_arrives_whole(peer, ask_for_much):
    """An image of a camera may be longer than the buffers of a connection."""
    connection = ask_for_much()
    peer.do(lambda: None)

    assert len(read_frame(connection)) == struct.calcsize("<I") + len(LONG_TEXT)


def test_a_client_that_reads_slowly_gets_the_whole_answer(peer, ask_for_much):
    """A client may read over a slow network, so the timeout starts only when all bytes are sent."""
    connection, later = ask_for_much(), threading.Event()
    peer.do(lambda: peer.node.later(10 * links.LINGER_S, later.set))
    assert later.wait(DEADLINE_S)

    assert len(read_frame(connection)) == struct.calcsize("<I") + len(LONG_TEXT)


def test_a_node_keeps_nothing_for_a_client_that_stops_reading(ask_for_much, monkeypatch):
    """If the node kept unsent data, it would hold an image in memory for each client that stopped reading."""
    monkeypatch.setattr(links, "SEND_S", 0.01)
    connection = ask_for_much()
    eventually(lambda: all(link.closed for link in links_there()))

    with pytest.raises(AssertionError, match="closed"):
        read_frame(connection)


def test_two_requests_in_one_packet_are_both_answered(peer, dial):
    """The stream consists of frames, and TCP packets may contain several of them."""
    header = service_header(peer, "get_time", "webots_ros/get_float", persistent="1")
    connection, _ = dial(**header)
    connection.sendall(frame(ASK) * 2)

    answers = [(read_exactly(connection, 1), read_frame(connection)) for _ in range(2)]

    assert answers == [(b"\x01", struct.pack("<d", 1.25))] * 2


def test_a_request_that_cannot_be_read_fails_alone(peer, dial):
    """As with roscpp, the connection stays open for the next request."""
    header = service_header(peer, "double", "webots_ros/set_float", persistent="1")
    connection, _ = dial(**header)
    connection.sendall(frame(b"abc") + frame(struct.pack("<d", 1.0)))

    refused = (read_exactly(connection, 1), read_frame(connection))
    answered = (read_exactly(connection, 1), read_frame(connection))

    assert refused == (b"\x00", b"3 bytes instead of 8")
    assert answered == (b"\x01", b"\x01")


@pytest.mark.parametrize(
    ("header", "fact"),
    [
        ({"service": "/nobody/here", "md5sum": "*"}, "this node has no service /nobody/here"),
        ({"topic": "/nobody/value", "md5sum": "*"}, "this node has no topic /nobody/value"),
        ({}, "this node has no topic None"),
    ],
)
def test_a_wrong_header_is_answered_with_an_error(dial, header, fact):
    """The client can show the error to its user, and the node closes the connection."""
    connection, answer = dial(**header)

    assert answer["error"] == fact
    assert connection.recv(1) == b""


def test_rosnode_info_lists_what_a_node_publishes_and_to_whom(peer, dial):
    """`rosnode info` calls `getPublications` and `getBusInfo`, and expects the results of a roscpp node."""
    topic = f"/{peer.name}/ir1/value"
    connection, _ = dial(topic=topic, md5sum="*")
    with slave_api(peer) as node:
        assert node.getPublications("/raw")[2] == [[topic, "sensor_msgs/Range"]]
        assert node.getBusInfo("/raw")[2] == [[1, "/raw", "o", "TCPROS", topic, True]]

        connection.close()
        eventually(lambda: node.getBusInfo("/raw")[2] == [])


def test_noise_on_the_port_disturbs_nobody(peer, dial):
    """A port scanner must not end a training."""
    connection, _ = dial(**service_header(peer, "get_time", "webots_ros/get_float"))
    connection.sendall(b"\xff" * 64)

    _, header = dial(**service_header(peer, "double", "webots_ros/set_float"))

    assert "error" not in header


def test_a_node_keeps_nothing_of_connections_that_it_has_refused(peer, dial):
    """A client of another release repeats its request every few seconds, for days."""
    before, count = len(links_there()), 5
    for _ in range(count):
        _, answer = dial(**service_header(peer, "double", "webots_ros/get_float"))
        assert "error" in answer

    eventually(lambda: len(links_there()) < before + count)  # the node's loop still refers to the last one


def links_there():
    """Return all connections of nodes in this process, open or closed."""
    return [each for each in gc.get_objects() if isinstance(each, links.RosLink)]


def test_requests_wait_while_the_controller_is_blocked(peer, dial):
    """Webots locks a mutex during a step, so other requests to the robot wait until the step ends."""
    blocked = []
    calls = []

    def step(_request):
        blocked.append(True)
        calls.append(peer.node.current_call)
        return LATER

    def prepare():
        peer.node.blocked = lambda: bool(blocked)
        peer.node.serve("step", "webots_ros/set_int", step)

    peer.do(prepare)
    stepping, _ = dial(**service_header(peer, "step", "webots_ros/set_int"))
    stepping.sendall(frame(struct.pack("<i", 32)))
    asking, _ = dial(**service_header(peer, "get_time", "webots_ros/get_float"))
    asking.sendall(frame(ASK))
    asking.settimeout(0.2)
    with pytest.raises(TimeoutError):
        asking.recv(1)

    def finish():
        blocked.clear()
        peer.node.answer(calls[0], {"success": True})

    peer.do(finish)

    asking.settimeout(5)
    assert read_exactly(stepping, 1) == b"\x01"
    assert read_exactly(asking, 1) == b"\x01"


def test_a_late_subscriber_of_a_latched_topic_gets_the_last_message(peer, dial):
    """A client learns from the topic /model_name which robots exist, even if it subscribes late."""
    peer.do(lambda: peer.node.advertise("name", "std_msgs/String", latched=True).send({"data": "robot"}))

    connection, header = dial(topic=f"/{peer.name}/name", md5sum="*", type="std_msgs/String")

    assert header["latching"] == "1"
    assert message_type("std_msgs/String").codec.decode(read_frame(connection)).data == "robot"


def test_a_subscriber_that_does_not_read_gets_the_newest(peer, dial):
    """A slow subscriber must not block the publisher.

    With queue size 1, the subscriber loses old messages and gets the newest one.
    """
    topic = {"topic": f"/{peer.name}/ir1/value", "md5sum": "*", "type": "sensor_msgs/Range"}
    connection, _ = dial(**topic)
    count = 200_000

    peer.do(lambda: [peer.publisher.send_value(float(number)) for number in range(count)])

    reader, values = FrameReader(), []
    while not values or values[-1] != count - 1:
        values += [struct.unpack("<f", data[-4:])[0] for data in reader.feed(connection.recv(65536))]
    assert len(values) < count
    assert values == sorted(values)


def test_the_slave_api_answers_what_tools_ask(peer):
    """`rosnode info` and `rosnode ping` call these methods."""
    with slave_api(peer) as slave:
        assert slave.getPid("/raw")[2] == os.getpid()
        assert slave.getMasterUri("/raw")[2] == os.environ["ROS_MASTER_URI"]
        assert slave.requestTopic("/raw", f"/{peer.name}/ir1/value", [["TCPROS"]])[2][0] == "TCPROS"
        assert slave.requestTopic("/raw", "/nothing", [["TCPROS"]])[0] == 0
