"""Topics over a real ROS master and real sockets; a message is read when the program requests it."""

import re
import socket
import struct
import subprocess
import sys
import threading
import time
import xmlrpc.client
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from palaestra_protocol.ros.tcpros import encode_header
from palaestra_trainer.errors import ConfigurationError, SimulatorDead, SimulatorHung
from palaestra_trainer.ros import RosSubscriber


@pytest.fixture
def ranges(peer):
    """Yield a connected subscriber to the peer's distance sensor."""
    subscriber = RosSubscriber(f"/{peer.name}/ir1/value", "sensor_msgs/Range", deadline_s=0.3)
    subscriber.connect()
    yield subscriber
    subscriber.close()


def send(peer, *values):
    """Publish these readings one after another."""
    peer.do(lambda: [peer.publisher.send_value(value) for value in values])


def test_connected_means_that_the_publisher_sends_to_us(peer, ranges):
    """Without a connection, the publisher would drop the first messages."""
    seen = []

    peer.do(lambda: seen.append(len(peer.publisher.topic.links)))

    assert ranges.connected
    assert seen == [1]


def test_the_next_message_is_the_oldest_unread(peer, ranges):
    """Each step publishes one message, so a skipped message would shift all later readings."""
    send(peer, 0.25, 0.5)

    assert [ranges.next().range for _ in range(2)] == [0.25, 0.5]


def test_the_newest_message_ends_a_backlog(peer, ranges):
    """After a delay, only the last message describes the current state."""
    send(peer, 0.25, 0.5, 0.75)
    ranges.next()

    assert ranges.newest(None).range == 0.75


def test_all_messages_that_have_arrived_are_read_at_once(peer, ranges):
    """A keyboard publishes any number of messages in a step."""
    send(peer, 0.25, 0.5, 0.75)

    assert [message.range for message in ranges.arrived()] == [0.25, 0.5, 0.75]
    assert ranges.arrived() == []


def test_with_nothing_new_the_old_value_stays(ranges):
    """The call must return at once if no message has arrived."""
    assert ranges.newest("old") == "old"


def test_a_message_that_does_not_come_raises_an_error_in_time(peer, ranges):
    """The message may only be late, so the connection stays open."""
    with pytest.raises(SimulatorHung):
        ranges.next()
    send(peer, 1.0)

    assert ranges.next().range == 1.0


def test_a_busy_publisher_may_take_longer_for_a_connection_than_for_a_message(master):
    """On a busy host, a publisher waits for a processor. Its simulator must not count as hung then."""
    deadline_s, busy_s = 0.05, 0.3
    with socket.create_server(("127.0.0.1", 0)) as listening:
        connections = []

        def accept_late():
            connections.append(listening.accept()[0])
            connections[0].recv(65536)
            time.sleep(busy_s)
            connections[0].sendall(encode_header({"callerid": "/busy"}))

        node = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        node.register_function(lambda *_: [1, "", ["TCPROS", *listening.getsockname()]], "requestTopic")
        for work in (node.handle_request, accept_late):
            threading.Thread(target=work, daemon=True).start()
        with node, xmlrpc.client.ServerProxy(master) as ask_master:
            uri = "http://{}:{}/".format(*node.server_address)
            ask_master.registerPublisher("/busy", "/busy/ir1/value", "sensor_msgs/Range", uri)
            subscriber = RosSubscriber("/busy/ir1/value", "sensor_msgs/Range", deadline_s=deadline_s)

            subscriber.connect()

            with pytest.raises(SimulatorHung, match=f"within {deadline_s} s"):
                subscriber.next()
            subscriber.close()
        connections[0].close()


def test_a_killed_publisher_is_dead(peer, ranges):
    """The kernel closes the connection of a killed publisher. So the error comes before the timeout."""
    peer.end(peer.node.abandon)

    with pytest.raises(SimulatorDead):
        ranges.next()


def test_a_topic_without_a_publisher_raises_an_error_at_once(peer):
    """If a sensor was never enabled, no node publishes its topic, so the program must not wait for it."""
    with pytest.raises(SimulatorDead, match="no node publishes"):
        RosSubscriber(f"/{peer.name}/ir2/value", "sensor_msgs/Range").connect()


def test_a_decoder_of_ones_own_gets_the_bytes(peer):
    """The trainer needs only the last field, and decoding the whole message would cost time."""
    last = struct.Struct("<f")
    subscriber = RosSubscriber(
        f"/{peer.name}/ir1/value", "sensor_msgs/Range", lambda data: last.unpack(data[-4:])[0]
    )
    subscriber.connect()
    send(peer, 0.125)

    value = subscriber.next()

    subscriber.close()
    assert value == 0.125


def test_stamps_and_numbers_of_messages_advance(peer, ranges):
    """Some subscribers match the messages of several topics by their stamps."""
    peer.do(lambda: [peer.publisher.send_value(0.0, stamp_ns=ns) for ns in (1, 2_000_000_003)])

    first, second = ranges.next().header, ranges.next().header

    assert (first.seq, first.stamp.secs, first.stamp.nsecs) == (1, 0, 1)
    assert (second.seq, second.stamp.secs, second.stamp.nsecs) == (2, 2, 3)


def test_a_withdrawn_topic_closes_its_connections(peer, ranges):
    """`enable(0)` withdraws the topic of a sensor in this way."""
    peer.do(lambda: peer.node.withdraw(peer.publisher))

    with pytest.raises(SimulatorDead):
        ranges.next()


ROBOT_OF_OTHERS = """
import sys
import rospy
from sensor_msgs.msg import JointState

rospy.init_node("arm")
publisher = rospy.Publisher("/arm/joints", JointState, queue_size=1, latch=True)
publisher.publish(JointState(name=["lift", "turn"], position=[0.5, -1.0]))
print("ready", flush=True)
sys.stdin.read()
"""


def test_a_node_of_others_is_read_by_the_name_of_a_common_type(master):
    """A robot's own nodes publish types that no simulator of ours has."""
    del master
    node = subprocess.Popen(
        [sys.executable, "-c", ROBOT_OF_OTHERS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    joints = RosSubscriber("/arm/joints", "sensor_msgs/JointState", deadline_s=30.0)
    with node:
        assert node.stdout.readline() == "ready\n"
        joints.connect()
        state = joints.next()
        joints.close()
        node.kill()

    assert (state.name, list(state.position)) == (["lift", "turn"], [0.5, -1.0])


@pytest.mark.parametrize(
    ("name", "type_name", "message"),
    [
        ("arm/joints", "std_msgs/Bool", '"arm/joints": is not the full name of a service or topic; begin it'),
        ("/arm/joints", "my_msgs/Joints", "my_msgs/Joints: is not a known type of this kind; use a type of"),
        ("/arm/joints", "std_srvs/Empty", "std_srvs/Empty: is not a known type of this kind; use a type of"),
    ],
)
def test_a_name_or_type_that_cannot_be_used_is_refused_at_once(name, type_name, message):
    """The mistake is the program's, so it must not look like a simulator that does not respond."""
    with pytest.raises(ConfigurationError, match=re.escape(message)):
        RosSubscriber(name, type_name)
