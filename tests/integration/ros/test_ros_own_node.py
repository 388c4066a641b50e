"""A program uses our own ROS node if rospy is not installed; with rospy, it uses rospy's node."""

import os
import re
import signal
import subprocess
import sys
import xmlrpc.client

import pytest

from palaestra_trainer.errors import ConfigurationError, MasterLost
from palaestra_trainer.ros import Master, own_node
from palaestra_trainer.ros.node_name import full_name

# After this line, rospy cannot be imported, as if it were not installed.
WITHOUT_ROSPY = "import sys; sys.modules['rospy'] = None\n"
WHICH = "from palaestra_trainer.ros import node; print(node.ensure_node.__module__)"
LISTEN = """
import os
from palaestra_trainer.ros import RosService, RosSubscriber, ensure_node
peer = os.environ["PEER"]
print(RosService(f"/{peer}/get_time", "webots_ros/get_float")(ask=True).value)
topic = RosSubscriber(f"/{peer}/ir1/value", "sensor_msgs/Range")
topic.connect()
print(ensure_node(), flush=True)
input()
print(topic.next().range)
topic.close()
"""


def run(program, **variables):
    """Return the output of a Python program."""
    return subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    ).stdout


@pytest.mark.usefixtures("master")
def test_rospy_is_the_node_exactly_where_it_is_installed():
    """A program's own publishers and services need rospy's node, and a process can have only one node."""
    assert run(WHICH) == "palaestra_trainer.ros.rospy_node\n"
    assert run(WITHOUT_ROSPY + WHICH) == "palaestra_trainer.ros.own_node\n"


def test_a_program_without_rospy_calls_listens_and_is_listed(peer):
    """A user finds the program under the same name in `rosnode list` and in the simulator's log."""
    with subprocess.Popen(
        [sys.executable, "-c", WITHOUT_ROSPY + LISTEN],
        env={**os.environ, "PEER": peer.name, "ROS_NAMESPACE": "lab"},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as program:
        time, name = program.stdout.readline(), program.stdout.readline().strip()
        listed = Master("/test").node_names()
        peer.do(lambda: peer.publisher.send_value(0.5))
        heard, _ = program.communicate("\n", timeout=60)

    assert (time, heard) == ("1.25\n", "0.5\n")
    assert name == f"/lab/palaestra_trainer_{program.pid}"
    assert name in listed
    assert name not in Master("/test").node_names()


def test_our_node_answers_the_master_and_tools(master):
    """ROS's own programs call our node like any other node.

    The master calls `publisherUpdate` and `paramUpdate`, a subscriber calls `requestTopic`, `rosnode ping`
    calls `getPid`, and `rosnode info` also calls `getBusInfo`. The other methods complete ROS's slave API.
    """
    name = own_node.ensure_node("tester")
    with xmlrpc.client.ServerProxy(own_node.node_uri()) as node:
        answers = {
            method: getattr(node, method)("/test", *given)[::2]
            for method, given in {
                "getPid": (),
                "getMasterUri": (),
                "getBusInfo": (),
                "getBusStats": (),
                "getSubscriptions": (),
                "getPublications": (),
                "publisherUpdate": ("/t", []),
                "paramUpdate": ("/p", 1),
                "requestTopic": ("/t", [["TCPROS"]]),
            }.items()
        }

    assert own_node.ensure_node() == name == f"/tester_{os.getpid()}"
    assert answers == {
        "getPid": [1, os.getpid()],
        "getMasterUri": [1, master],
        "getBusInfo": [1, []],
        "getBusStats": [1, [[], [], []]],
        "getSubscriptions": [1, []],
        "getPublications": [1, []],
        "publisherUpdate": [1, 0],
        "paramUpdate": [1, 0],
        "requestTopic": [0, 0],
    }


NAMED = "import sys; sys.argv[1:] = {}\n"
ENSURE = "from palaestra_trainer.ros import ensure_node; print(ensure_node('tester'))"


@pytest.mark.usefixtures("master")
@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (["__name:=mine"], "/lab/mine"),
        (["__ns:=/other/", "__name:=mine", "a:=b", "_p:=1"], "/other/mine"),
        (["__name:=/mine"], "/mine"),
        (["__ns:=other"], r"/other/tester_\d+"),
        (["name:=mine"], r"/lab/tester_\d+"),
    ],
)
def test_arguments_rename_our_node_as_they_rename_rospys(arguments, name):
    """`roslaunch` adds such arguments, and a program must have the same name with and without rospy."""
    program = NAMED.format(arguments) + ENSURE

    assert re.fullmatch(name, run(program, ROS_NAMESPACE="lab").splitlines()[-1])
    assert re.fullmatch(name, run(WITHOUT_ROSPY + program, ROS_NAMESPACE="lab").strip())


def test_a_name_that_no_node_can_have_is_refused():
    """The master would accept the name, but tools would not find the node."""
    with pytest.raises(ConfigurationError, match="__name:=my robot: is not a valid ROS name; begin"):
        full_name("tester", ["__name:=my robot"], {})


UNTIL_KILLED = """
import time
from palaestra_trainer.ros import ensure_node
from palaestra_trainer.ros.node import node_uri
from palaestra_trainer.run.signals import Interruption
ensure_node()
print(node_uri(), flush=True)
with {} as interruption:
    for _ in range(600):
        time.sleep(0.1)
        if interruption and interruption.requested:
            time.sleep(1)
            print(interruption.requested.name)
            break
"""


@pytest.mark.usefixtures("master")
@pytest.mark.parametrize(
    ("listening", "code", "printed"),
    [("Interruption()", 0, ["SIGTERM"]), ("__import__('contextlib').nullcontext()", -signal.SIGTERM, [])],
    ids=["a training", "a script"],
)
def test_rosnode_kill_ends_our_process_as_sigterm_does(listening, code, printed):
    """The caller must get its response first, and a second request must not prevent the checkpoint."""
    with subprocess.Popen(
        [sys.executable, "-c", WITHOUT_ROSPY + UNTIL_KILLED.format(listening)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as program:
        with xmlrpc.client.ServerProxy(program.stdout.readline().strip()) as node:
            other = node.shutdown("/master", "[/gone] Reason: new node registered with same name")
            responses = [node.shutdown("/rosnode", "user request")[::2] for _ in range(2)]
        ended, _ = program.communicate(timeout=60)

    assert other[0] == 0  # a master may send this request if a killed node had the same port
    assert responses == [[1, 0], [1, 0]]
    assert program.returncode == code
    assert ended.splitlines()[1:] == printed  # the first line is from the log


NO_MASTER = (
    WITHOUT_ROSPY
    + """
from palaestra_trainer.ros import ensure_node
from palaestra_trainer.errors import MasterLost
try:
    ensure_node()
except MasterLost as error:
    print(error)
"""
)


def test_without_a_master_there_is_no_node():
    """A node of rospy would wait forever, so the trainer checks first that the master responds."""
    assert issubclass(MasterLost, ConnectionError)
    assert "no ROS master responds at http://localhost:1" in run(
        NO_MASTER, ROS_MASTER_URI="http://localhost:1"
    )
