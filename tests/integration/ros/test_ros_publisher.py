"""The publisher of a program, over a real ROS master and real sockets."""

import importlib.util
import socket
import subprocess
import sys
import time
import xmlrpc.client

import pytest

from palaestra_protocol.ros.rostypes import message_type
from palaestra_protocol.ros.tcpros import FrameReader, decode_header, encode_header
from palaestra_protocol.ros.topic_headers import subscriber_header
from palaestra_trainer.errors import ConfigurationError, MasterLost
from palaestra_trainer.ros import Master, RosSubscriber
from palaestra_trainer.ros.publisher import RosPublisher
from palaestra_trainer.ros.topic_node import TopicNode, host_toward
from tests.waiting import eventually

DEADLINE_S = 30.0
TOPIC, TYPE = "/cmd_vel", "geometry_msgs/Twist"
FORWARD = {"linear": {"x": 0.25}}
SUBSCRIBER = """
import sys, rospy
from geometry_msgs.msg import Twist
rospy.init_node("driver", disable_signals=True)
heard = []
rospy.Subscriber("/cmd_vel", Twist, lambda twist: print(twist.linear.x, flush=True))
print("ready", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def node(master):
    """Yield a node that no other test uses."""
    node = TopicNode("/speaker", master)
    yield node
    node.close()


@pytest.fixture
def publisher(node):
    """Yield a publisher without subscribers."""
    publisher = RosPublisher(node, TOPIC, TYPE)
    yield publisher
    publisher.close()


@pytest.fixture
def subscriber(publisher):
    """Yield a subscriber that is connected."""
    subscriber = RosSubscriber(TOPIC, TYPE, deadline_s=DEADLINE_S)
    subscriber.connect()
    assert publisher.wait_for_subscriber(DEADLINE_S)
    yield subscriber
    subscriber.close()


def address(node):
    """Return the address that the node reports to a subscriber."""
    with xmlrpc.client.ServerProxy(node.uri) as peer:
        code, _, value = peer.requestTopic("/test", TOPIC, [["TCPROS"]])
    return tuple(value[1:]) if code == 1 else None


def connection(node, type_name=TYPE):
    """Return a raw connection that has sent its header and reads nothing."""
    raw = socket.socket()
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    raw.settimeout(DEADLINE_S)
    raw.connect(address(node))
    raw.sendall(encode_header(subscriber_header("/raw", TOPIC, message_type(type_name))))
    return raw


def header_of(raw):
    """Return the header with which the publisher responds."""
    frames = FrameReader()
    while True:
        for payload in frames.feed(raw.recv(4096)):
            return decode_header(payload)


def test_a_message_reaches_each_subscriber_at_once(publisher, subscriber):
    """A command that is delayed until the next command would be too late for the dead man's switch."""
    assert publisher.publish(**FORWARD) == 1
    assert subscriber.next().linear.x == 0.25


def test_without_a_subscriber_the_caller_learns_that_nobody_listens(publisher):
    """A program must not believe that a robot obeys."""
    assert publisher.publish(**FORWARD) == 0
    assert not publisher.wait_for_subscriber(0.0)


def test_a_subscriber_that_leaves_is_not_counted(publisher, subscriber):
    """If the publisher counted a program that has ended, its caller would believe that a robot obeys."""
    subscriber.close()

    eventually(lambda: publisher.publish(**FORWARD) == 0, pace_s=0.002)


def test_a_subscriber_that_does_not_read_is_dropped_and_delays_nobody(node, publisher, subscriber):
    """The subscriber would get old commands, and a wait for it would stop the robots of other subscribers."""
    slow = connection(node)
    header_of(slow)
    eventually(lambda: publisher.publish(**FORWARD) == 2, pace_s=0.002)
    longest_s = 0.0
    for _ in range(20_000):
        began = time.perf_counter()
        left = publisher.publish(**FORWARD)
        longest_s = max(longest_s, time.perf_counter() - began)
        subscriber.arrived()
        if left == 1:
            break

    slow.close()
    assert left == 1
    assert longest_s < 1.0
    assert publisher.publish(**FORWARD) == 1


def test_a_subscriber_of_another_type_is_refused(node, publisher):
    """The subscriber would read the bytes of another type as wrong numbers."""
    with connection(node, "std_msgs/Bool") as raw:
        error = header_of(raw)["error"]

    assert "but geometry_msgs/Twist has" in error
    assert publisher.publish(**FORWARD) == 0


@pytest.mark.parametrize("data", [b"\xff\xff\xff\xff", b"\x04\0\0\0\x09\0\0\0"], ids=["too long", "cut"])
def test_a_peer_that_sends_no_header_is_refused(node, publisher, data):
    """A program that scans ports must not disturb a robot."""
    with socket.create_connection(address(node), DEADLINE_S) as raw:
        raw.sendall(data)
        error = header_of(raw)["error"]

    assert "frame of" in error or "header" in error
    assert publisher.publish(**FORWARD) == 0


def test_the_topic_is_registered_until_the_end(node, publisher):
    """A subscriber of a topic without a publisher would try to connect again and again."""
    before = Master("/test").publishers(TOPIC), address(node)
    with xmlrpc.client.ServerProxy(node.uri) as peer:
        listed = peer.getPublications("/test")[2]
    publisher.close()

    assert before[0] == {"/speaker"}
    assert listed == [[TOPIC, TYPE]]
    assert Master("/test").publishers(TOPIC) == set()
    assert address(node) is None
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(before[1], DEADLINE_S)


def test_without_a_master_there_is_no_publisher():
    """The error names the address, because the usual mistake is a wrong address."""
    node = TopicNode("/speaker", "http://127.0.0.1:1/")
    with pytest.raises(MasterLost, match=r"no ROS master responds at http://127\.0\.0\.1:1/"):
        RosPublisher(node, TOPIC, TYPE)
    node.close()


def test_an_unknown_type_is_refused(node):
    """The mistake is in the user's program, so the error must not look like a lost master."""
    with pytest.raises(ConfigurationError, match="my_msgs/Twist: is not a known type"):
        RosPublisher(node, TOPIC, "my_msgs/Twist")


@pytest.mark.parametrize(
    ("environment", "host"),
    [({}, "127.0.0.1"), ({"ROS_IP": "10.0.0.7"}, "10.0.0.7"), ({"ROS_HOSTNAME": "pc"}, "pc")],
)
def test_the_node_has_an_address_that_the_master_reaches(environment, host):
    """Rospy would use the host name of a laptop, which a robot often cannot resolve."""
    assert host_toward("http://127.0.0.1:11311/", environment) == host


@pytest.mark.skipif(importlib.util.find_spec("rospy") is None, reason="rospy is not installed")
def test_rospy_hears_our_publisher(publisher):
    """A Robotino's driver and other programs of a laboratory use ROS's own libraries."""
    program = [sys.executable, "-c", SUBSCRIBER]
    with subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as driver:
        ready = driver.stdout.readline()
        connected = publisher.wait_for_subscriber(DEADLINE_S)
        sent = publisher.publish(**FORWARD)
        heard = driver.stdout.readline()
        driver.kill()

    assert (ready, connected, sent, heard) == ("ready\n", True, 1, "0.25\n")
