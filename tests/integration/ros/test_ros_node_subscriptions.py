"""The subscriptions of a simulator's node, over a real ROS master and real sockets."""

import socket
import threading
import xmlrpc.client

import pytest

from palaestra_protocol.ros.rostypes import message_type
from palaestra_protocol.ros.tcpros import LENGTH, encode_header
from palaestra_protocol.ros.topic_headers import publisher_header
from palaestra_protocol.xmlrpc.server import RpcServer
from palaestra_sim.ros import Loop, RosNode
from palaestra_trainer.ros import Master
from tests.integration.ros.conftest import DEADLINE_S, Peer
from tests.waiting import eventually

TYPE = "sensor_msgs/Range"


class Listener:
    """A node in a thread of its own, with one subscription."""

    def __init__(self, master_uri, topic, name="listener"):
        self.heard = []
        self.loop = Loop()
        self.node = RosNode(self.loop, name, master_uri)
        self.node.subscribe(topic, TYPE, lambda message: self.heard.append(message.range))
        self.thread = threading.Thread(target=self.loop.run, daemon=True)
        self.thread.start()

    def connected(self):
        """Return the number of publishers to which the node is connected, as `rosnode info` sees it."""
        return [entry[2] for entry in self.node.connections()].count("i")

    def close(self):
        """Close the node and end the thread."""
        self.loop.post(lambda: (self.node.close(), self.loop.stop()))
        self.thread.join(DEADLINE_S)
        self.loop.close()


@pytest.fixture
def listener(master, peer):
    """Yield a node that is connected to the peer's distance sensor."""
    listener = Listener(master, f"/{peer.name}/ir1/value")
    eventually(listener.connected, pace_s=0.002)
    yield listener
    listener.close()


def send(peer, *values):
    """Publish these readings one after another."""
    peer.do(lambda: [peer.publisher.send_value(value) for value in values])


def test_all_messages_arrive_in_their_order(peer, listener):
    """The node must not drop commands, because the handler of commands decides which of them it uses."""
    values = [0.125 * number for number in range(20)]
    for value in values:  # a publisher of queue size 1 drops messages that the kernel does not take at once
        send(peer, value)

    assert eventually(lambda: listener.heard[19:] and listener.heard, pace_s=0.002) == values


def test_a_publisher_that_comes_later_is_found(master):
    """A robot's driver starts first, and the programs that command the robot start later."""
    listener = Listener(master, "/later/ir1/value")
    peer = Peer("later", master)
    eventually(listener.connected, pace_s=0.002)
    send(peer, 0.5)
    heard = eventually(lambda: listener.heard, pace_s=0.002)
    peer.end()
    listener.close()

    assert heard == [0.5]


def test_a_publisher_that_was_killed_and_started_again_is_found(master):
    """A program that commands a robot may crash, and the driver must obey the next one."""
    first = Peer("again", master)
    listener = Listener(master, "/again/ir1/value")
    eventually(listener.connected, pace_s=0.002)
    first.end(first.node.abandon)
    eventually(lambda: not listener.connected(), pace_s=0.002)

    second = Peer("again", master)
    eventually(listener.connected, pace_s=0.002)
    send(second, 0.75)
    heard = eventually(lambda: listener.heard, pace_s=0.002)
    second.end()
    listener.close()

    assert heard == [0.75]


def test_a_lost_connection_is_opened_again(peer, listener):
    """The publisher is still registered, so the master sends no update. The node itself must reconnect."""
    peer.do(peer.publisher.topic.links[0].close)
    eventually(lambda: not listener.connected(), pace_s=0.002)

    eventually(listener.connected, pace_s=0.01)
    send(peer, 0.25)

    assert eventually(lambda: listener.heard, pace_s=0.002) == [0.25]


def test_a_publisher_that_ends_is_disconnected(peer, listener):
    """`unregisterPublisher` makes the master send a list without the publisher."""
    peer.end()

    eventually(lambda: not listener.connected(), pace_s=0.002)


def test_tools_see_the_subscription_and_its_connection(master, listener):
    """`rosnode info` requests its connections from the node, so the node must report the subscription."""
    with xmlrpc.client.ServerProxy(master) as registry:
        uri = registry.lookupNode("/test", "/listener")[2]
    with xmlrpc.client.ServerProxy(uri) as node:
        subscriptions, connections = node.getSubscriptions("/test")[2], node.getBusInfo("/test")[2]

    topic = listener.node.subscriptions()[0][0]
    assert subscriptions == [[topic, TYPE]]
    assert [entry[2:] for entry in connections] == [["i", "TCPROS", topic, True]]


def test_a_closed_node_is_not_registered(master, peer):
    """A later publisher of the topic would otherwise try to connect to the closed node."""
    listener = Listener(master, f"/{peer.name}/ir1/value", "short")
    eventually(listener.connected, pace_s=0.002)
    before = Master("/test").node_names()
    listener.close()

    assert "/short" in before
    assert "/short" not in Master("/test").node_names()
    eventually(lambda: not peer.publisher.heard, pace_s=0.002)


class Forger:
    """A publisher that sends any bytes after its header."""

    def __init__(self, topic, type_name=TYPE):
        self.topic, self.type = topic, message_type(type_name)
        self.listener = socket.create_server(("127.0.0.1", 0))
        address = ["TCPROS", *self.listener.getsockname()]
        self.rpc = RpcServer(("127.0.0.1", 0), lambda _: lambda _: [1, "", address])
        self.master, self.uri = Master("/forger"), f"http://127.0.0.1:{self.rpc.port}/"

    def __enter__(self):
        self.rpc.start()
        self.master.register_publisher(self.topic, self.type.name, self.uri)
        self.listener.settimeout(DEADLINE_S)
        self.connection, _ = self.listener.accept()
        self.connection.settimeout(DEADLINE_S)
        self.connection.sendall(encode_header(publisher_header("/forger", self.topic, self.type, {})))
        return self.connection

    def __exit__(self, *_):
        self.master.unregister_publisher(self.topic, self.uri)
        self.connection.close()
        self.listener.close()
        self.rpc.close()


def rest_of(connection):
    """Return all bytes until the peer closes the connection."""
    with connection.makefile("rb") as stream:
        return stream.read()


def test_a_message_longer_than_the_limit_ends_the_connection(master):
    """A publisher must not fill the memory of a simulator."""
    listener = Listener(master, "/forged", "limited")
    with Forger("/forged") as connection:
        connection.sendall(LENGTH.pack((1 << 20) + 1) + b"\0")
        ended = rest_of(connection)
    listener.close()

    assert b"more than the limit of 1048576" in ended
    assert listener.heard == []


def test_a_publisher_of_another_type_is_refused(master):
    """Two programs may use one topic name for different types, whose bytes must not be mixed up."""
    listener = Listener(master, "/forged", "typed")
    with Forger("/forged", "std_msgs/Bool") as connection:
        ended = rest_of(connection)
    listener.close()

    assert b"not that of sensor_msgs/Range" in ended


def test_a_message_that_cannot_be_decoded_is_left_out(master):
    """The connection must stay open, because the next message may be right."""
    listener = Listener(master, "/forged", "patient")
    with Forger("/forged") as connection:
        connection.sendall(LENGTH.pack(3) + b"abc" + message_type(TYPE).codec.frame({"range": 0.5}))
        heard = eventually(lambda: listener.heard, pace_s=0.002)
    listener.close()

    assert heard == [0.5]
