"""Service calls over a real ROS master and real sockets: each returns a response or raises a fault."""

import contextlib
import gc
import json
import os
import select
import socket
import subprocess
import sys

import pytest

from palaestra_trainer.errors import SimulatorDead, SimulatorHung, WrongData
from palaestra_trainer.ros import Master, RosService, call_together, ensure_node
from palaestra_trainer.waiting import shutdown_deadline
from palaestra_trainer.waiting.wait_time import waited_s

DEADLINE_S = 60.0  # the waits take milliseconds on an idle machine

PROGRAM_WITH_A_NODE = """\
import json, os, sys
import rospy

rospy.init_node("RobotinoAgent", anonymous=False)

from palaestra_trainer.ros import Master, RosService, RosSubscriber, ensure_node

peer = sys.argv[1]
subscriber = RosSubscriber(f"{peer}/ir1/value", "sensor_msgs/Range")
subscriber.connect()
print(json.dumps({
    "value": RosService(f"{peer}/get_time", "webots_ros/get_float")(ask=True).value,
    "connected": subscriber.connected,
    "node": ensure_node(),
    "listed": sorted(Master("/test").node_names()),
    "pid": os.getpid(),
}))
"""


@pytest.fixture
def service(peer):
    """Yield a function that returns services of the peer; they are closed at the end."""
    made = []

    def make(path, type_name="webots_ros/get_float", **options):
        made.append(RosService(f"/{peer.name}/{path}", type_name, **options))
        return made[-1]

    yield make
    for each in made:
        each.close()


@pytest.mark.parametrize("length", [0, 430, 439, 440, 449, 5_000, 100_000])
def test_an_answer_of_any_length_comes_whole_also_after_short_ones(peer, service, length):
    """The first read is short, so a longer response arrives in several parts."""
    texts = []
    peer.do(lambda: peer.node.serve("text", "webots_ros/get_string", lambda _: {"value": texts.pop()}))
    ask = service("text", "webots_ros/get_string")

    for wanted in ("short", "x" * length, "short"):
        texts.append(wanted)
        ask.begin(ask=True)
        assert select.select([ask], [], [], DEADLINE_S)[0], "no answer"
        assert ask.finish().value == wanted


def test_a_packed_request_may_be_sent_again_and_again(peer, service):
    """A step sends the same request for a pose each time, so its bytes are made only once."""
    heard = []
    peer.do(lambda: peer.node.serve("hear", "webots_ros/set_int", lambda it: heard.append(it.value) or {}))
    hear = service("hear", "webots_ros/set_int")
    packed = hear.packed(value=7)

    for _ in range(2):
        hear.send(packed)
        hear.finish()

    assert heard == [7, 7]


@pytest.mark.parametrize("length", [0, 439, 440, 441, 5_000, 100_000])
def test_a_request_of_any_length_arrives_whole(peer, service, length):
    """A request may contain a whole world file."""
    heard = []
    peer.do(lambda: peer.node.serve("hear", "webots_ros/set_string", lambda it: heard.append(it.value) or {}))

    for text in ("x" * length, "short"):
        service("hear", "webots_ros/set_string")(value=text)

    assert heard == ["x" * length, "short"]


def test_a_call_returns_the_response(service):
    """A caller reads the fields of the response as attributes."""
    assert service("get_time")(ask=True).value == 1.25


def test_one_connection_serves_all_calls(peer, service):
    """With a new look-up and a new connection, each call would take forty times as long."""
    double = service("double", "webots_ros/set_float")

    assert [double(value=value).success for value in (1.0, -1.0, 2.0)] == [True, False, True]
    assert peer.asked == [1.0, -1.0, 2.0]


def test_calls_together_are_all_answered(service):
    """Three wheels receive their commands in the time of a single round trip."""
    double = service("double", "webots_ros/set_float")
    time = service("get_time")

    first, second = call_together([(double, {"value": 1.0}), (time, {"ask": True})])

    assert (first.success, second.value) == (True, 1.25)


def test_both_ends_are_set_up_for_small_messages(service):
    """BBR is a common default for congestion control.

    It needs a timer for each connection, which slows four simulators down.
    """
    double = service("double", "webots_ros/set_float")
    double.begin(value=1.0)

    with socket.socket(fileno=os.dup(double.fileno())) as client:
        for end in (client, connected_to(client.getsockname())):
            assert end.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
            assert end.getsockopt(socket.IPPROTO_TCP, socket.TCP_CONGESTION, 16).rstrip(b"\0") == b"reno"
    assert double.finish().success


def connected_to(address):
    """Return the socket in this process whose peer has this address.

    The node runs in a thread, so its sockets belong to this process.
    """
    for it in gc.get_objects():
        if isinstance(it, socket.socket):
            with contextlib.suppress(OSError):
                if it.getpeername() == address:
                    return it
    raise LookupError(address)


def test_a_service_nobody_offers_means_a_dead_simulator(service):
    """The master lists no node for the service, so the simulator must have ended."""
    with pytest.raises(SimulatorDead, match="no node serves"):
        service("nothing")(ask=True)


def test_a_failed_call_is_wrong_data_with_the_servers_words(service):
    """The server has responded, so the simulator neither hangs nor has ended."""
    with pytest.raises(WrongData, match="the handle is 0"):
        service("fail")(ask=True)


def test_a_service_that_does_not_answer_hangs(service):
    """A proxy of rospy would wait forever here, and training would stop."""
    with pytest.raises(SimulatorHung, match=r"does not respond within 0\.2 s"):
        service("never", deadline_s=0.2)(ask=True)


def test_when_patience_is_over_nobody_is_waited_for(service):
    """Sixteen hanging simulators must not delay the end of a trainer by sixteen timeouts."""
    never = [service("never", deadline_s=30.0) for _ in range(16)]
    get_time = service("get_time")
    get_time(ask=True)
    for each in never:
        each.begin(ask=True)
    before = waited_s()

    shutdown_deadline.end(after_s=-1.0)
    try:
        for each in never:
            with pytest.raises(SimulatorHung):
                each.finish()
    finally:
        shutdown_deadline.renew()

    assert waited_s() - before < 5.0
    assert get_time(ask=True).value == 1.25


def test_what_a_call_waited_for_its_answer_is_counted(service):
    """From this counter, a user learns how much of a run's time its simulators needed."""
    before = waited_s()
    with pytest.raises(SimulatorHung):
        service("never", deadline_s=0.2)(ask=True)

    assert 0.19 < waited_s() - before < 5.0


def test_a_killed_node_is_dead(peer, service):
    """The kernel closes a killed node's sockets without a message, and the master still lists the node."""
    get_time = service("get_time")
    get_time(ask=True)
    peer.end(peer.node.abandon)

    with pytest.raises(SimulatorDead):
        get_time(ask=True)
    with pytest.raises(SimulatorDead):
        get_time(ask=True)


def test_a_client_can_wait_until_a_node_ends(peer, service):
    """After a reload of a world, the old controllers respond for a moment, and then end."""
    get_time = service("get_time")
    get_time(ask=True)
    before = get_time.await_end(0.0)
    peer.end(peer.node.abandon)

    assert before is False
    assert get_time.await_end(DEADLINE_S) is True


def test_after_a_failure_the_connection_is_made_anew(peer, master, service):
    """A restarted simulator has the same name but another port."""
    get_time = service("get_time")
    get_time(ask=True)
    peer.end(peer.node.abandon)
    with pytest.raises(SimulatorDead):
        get_time(ask=True)
    again = type(peer)(peer.name, master)

    answer = get_time(ask=True)

    again.end()
    assert answer.value == 1.25


def test_another_type_is_refused(service):
    """The node compares the md5 sums before the first call, so it never decodes bytes of another type."""
    with pytest.raises(WrongData, match="md5sum"):
        service("get_time", "webots_ros/set_int")(value=1)


def test_the_master_knows_the_address_of_a_service(peer):
    """`rosservice type` gets this address from the master, and then requests the type from the node."""
    host, port = Master("/probe").service_address(f"/{peer.name}/double")

    assert (host, port > 0) == (os.environ["ROS_HOSTNAME"], True)


def test_the_node_is_listed_by_the_master(peer):
    """`rosnode list` prints these names."""
    names = Master(ensure_node()).node_names()

    assert f"/{peer.name}" in names


def test_a_program_that_is_a_node_already_stays_the_one_it_is(peer):
    """A process can have only one node.

    A script may call `init_node` first, and other programs find it under that name.
    """
    program = [sys.executable, "-c", PROGRAM_WITH_A_NODE, f"/{peer.name}"]

    answer = subprocess.run(program, capture_output=True, text=True, timeout=60, check=False)

    assert answer.returncode == 0, answer.stderr
    said = json.loads(answer.stdout)
    assert (said["node"], said["value"], said["connected"]) == ("/RobotinoAgent", 1.25, True)
    assert "/RobotinoAgent" in said["listed"]
    assert not [name for name in said["listed"] if name.endswith(f"_{said['pid']}")]


def test_a_node_that_ends_in_good_order_is_unregistered(peer):
    """The old address must not stay at the master.

    Clients would look there for the next simulator of that name.
    """
    peer.end()

    assert Master("/probe").service_address(f"/{peer.name}/double") is None
