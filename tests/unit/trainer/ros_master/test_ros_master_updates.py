"""Sending updates to nodes over real sockets."""

import threading
import time

import pytest

from palaestra_protocol.xmlrpc.server import RpcServer
from palaestra_trainer.ros_master.api import Update
from palaestra_trainer.ros_master.updates import Updates
from tests.waiting import eventually

PATIENCE_S = 30.0


class Slave:
    """A node that records its updates, and responds only while `free` is set."""

    def __init__(self, code=1):
        self.got = []
        self.free = threading.Event()
        self.free.set()
        self._code = code
        self.server = RpcServer(("127.0.0.1", 0), lambda method: lambda given: self._take(method, given))
        self.server.start()
        self.uri = f"http://127.0.0.1:{self.server.port}/"

    def _take(self, method, given):
        self.got.append((method, *given[1:]))
        self.free.wait(PATIENCE_S)
        return [self._code, "", 0]

    def publishers(self, topic, *uris):
        """Return an update with the publishers of a topic."""
        return Update(self.uri, "publisherUpdate", topic, list(uris))


@pytest.fixture
def slave():
    """Yield a function that makes nodes, which are closed at the end."""
    made = []

    def make(**options):
        made.append(Slave(**options))
        return made[-1]

    yield make
    for each in made:
        each.free.set()
        each.server.close()


def refused(update):
    """Fail, because no node in this test rejects an update."""
    raise AssertionError(update)


def test_updates_of_one_node_arrive_in_order_and_only_the_newest_of_a_subject(slave):
    """A slow node would never catch up with all updates, and only the newest list matters."""
    node, updates = slave(), Updates(refused)
    node.free.clear()
    updates.add([node.publishers("/first", "http://a")])
    eventually(lambda: node.got)

    updates.add([node.publishers("/x", "http://1"), node.publishers("/y", "http://1")])
    updates.add([node.publishers("/x", "http://2"), Update(node.uri, "shutdown", "/n", "[/n] Reason: x")])
    node.free.set()

    eventually(lambda: len(node.got) == 4)
    assert node.got[1:] == [
        ("publisherUpdate", "/y", ["http://1"]),
        ("publisherUpdate", "/x", ["http://2"]),
        ("shutdown", "[/n] Reason: x"),
    ]


def test_nodes_that_hang_or_are_gone_delay_no_other(slave):
    """A trainer that was stopped with SIGSTOP must not keep simulators from finding each other."""
    hung, live = [slave() for _ in range(20)], slave()
    updates = Updates(refused, deadline_s=PATIENCE_S)
    for node in hung:
        node.free.clear()
    began = time.monotonic()

    updates.add([node.publishers("/t") for node in hung])
    updates.add([Update("http://127.0.0.1:1/", "publisherUpdate", "/t", []), live.publishers("/t")])

    eventually(lambda: live.got)
    assert time.monotonic() - began < PATIENCE_S


def test_an_update_to_a_node_that_hangs_ends_at_its_deadline(slave):
    """The next update is tried, because the node may only have been busy."""
    node = slave()
    node.free.clear()
    updates = Updates(refused, deadline_s=0.1)

    updates.add([node.publishers("/x"), node.publishers("/y")])

    eventually(lambda: [topic for _, topic, _ in node.got] == ["/x", "/y"])


def test_an_invalid_address_is_dropped(slave):
    """Any program may register an invalid address."""
    node, updates = slave(), Updates(refused)

    updates.add([Update(uri, "shutdown", "/n", "") for uri in ("http://", "rosrpc://h:1", "http://h:x")])
    updates.add([node.publishers("/t")])

    eventually(lambda: node.got)


def test_a_node_that_refuses_a_parameter_is_reported(slave):
    """The master then unsubscribes the node from the parameter."""
    node, reported = slave(code=-1), []
    update = Update(node.uri, "paramUpdate", "/x/", 5, "/n")

    Updates(reported.append).add([update, node.publishers("/t")])

    eventually(lambda: len(node.got) == 2)
    assert reported == [update]
