"""The client of a ROS master, against a program that responds in another way than a master does."""

import pytest

from palaestra_protocol.xmlrpc.server import RpcServer
from palaestra_trainer.errors import MasterLost, UnreadableAnswer
from palaestra_trainer.ros import Master

NOWHERE = "http://127.0.0.1:1"


@pytest.fixture
def responding():
    """Yield a function that returns the client of a server with one response to each method."""
    servers = []

    def make(**values):
        def respond(method):
            return lambda _: values[method]

        servers.append(RpcServer(("127.0.0.1", 0), respond))
        servers[-1].start()
        return Master("/trainer", uri=f"http://127.0.0.1:{servers[-1].port}")

    yield make
    for each in servers:
        each.close()


def test_without_a_master_the_message_asks_whether_it_runs():
    """The message has the address of the master, because ROS_MASTER_URI may name another computer."""
    with pytest.raises(MasterLost, match=f"no ROS master responds at {NOWHERE} .*; is it running"):
        Master("/trainer", uri=NOWHERE).ping()


@pytest.mark.parametrize("code", [-1, 0])
def test_a_method_that_the_master_refuses_is_named(responding, code):
    """A master with access rules may refuse one node only."""
    master = responding(registerPublisher=[code, "not from this host", 0])

    with pytest.raises(MasterLost, match="the ROS master refused registerPublisher: not from this host"):
        master.register_publisher("/t", "std_msgs/Bool", NOWHERE)


@pytest.mark.parametrize(
    "value", [[[], []], [["/t", "/u"]], 5], ids=["two parts", "no lists of nodes", "a number"]
)
def test_a_system_state_of_another_form_is_unreadable(responding, value):
    """Nodes would otherwise be taken for missing, and a simulator with their names would be started."""
    master = responding(getSystemState=[1, "", value])

    with pytest.raises(UnreadableAnswer, match=r"the ROS master responded with .* instead of"):
        master.node_names()


def test_a_node_whose_program_belongs_to_another_master_does_not_run(responding):
    """A killed node stays registered, and the kernel may give its port to a node of another master."""
    other = responding(getMasterUri=[1, "", "http://127.0.0.1:5"])
    master = responding(lookupNode=[1, "", other.uri])

    assert not master.runs("/robot")


def test_a_node_without_a_readable_address_of_its_master_counts_as_running(responding):
    """If the client counted the node as gone, a second simulator would get the same names."""
    other = responding(getMasterUri=[1, "", "http://[::1"])
    master = responding(lookupNode=[1, "", other.uri])

    assert master.runs("/robot")
