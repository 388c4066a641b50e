"""For equal calls, our ROS master gives the same responses and updates as rosmaster, the master of ROS."""

import copy
import logging
import os
import subprocess
import sys
import xmlrpc.client

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosmaster.master_api import ROSMasterHandler

from palaestra_trainer.ros_master.api import MasterApi
from palaestra_trainer.ros_master.serving import MasterServer
from tests.waiting import eventually

# rosmaster logs a traceback for each wrong argument.
logging.getLogger("rosmaster").setLevel(logging.CRITICAL)
URI = "http://localhost:11311/"
CALLERS = st.sampled_from(["/a", "/b", "/ns/c", "/"])
URIS = st.sampled_from([f"http://host:{port}/" for port in (1, 2, 3)] + ["ftp://host", "", 7])
ADDRESSES = st.sampled_from(["rosrpc://host:4", "rosrpc://host:5", "host:6", None])
NAMES = st.sampled_from(["t", "/t", "/ns/t", "ns//t/", "~t", "a b", "x:y", "/", "", 5])
NODES = st.sampled_from(["/a", "/b", "c", "/ns/c", "nobody", "", 5])
TYPES = st.sampled_from(["std_msgs/String", "std_msgs/Int32", "*", "String", "a/b/c", "", 5])
KEYS = st.sampled_from(["x", "/x", "/x/y", "y/z", "~x", "/ns/x/y", "x//y/", "/", "/ns", "", 5])
VALUES = st.sampled_from(
    [1, "text", False, [1, 2], {}, {"y": 1}, {"y": {"z": 2}, "x": 3}, {"x": {"y": {}}}, None]
)
CALLS = st.one_of(
    st.tuples(st.just("registerService"), st.tuples(CALLERS, NAMES, ADDRESSES, URIS)),
    st.tuples(st.just("unregisterService"), st.tuples(CALLERS, NAMES, ADDRESSES)),
    st.tuples(st.just("lookupService"), st.tuples(CALLERS, NAMES)),
    st.tuples(
        st.sampled_from(["registerSubscriber", "registerPublisher"]), st.tuples(CALLERS, NAMES, TYPES, URIS)
    ),
    st.tuples(
        st.sampled_from(["unregisterSubscriber", "unregisterPublisher"]), st.tuples(CALLERS, NAMES, URIS)
    ),
    st.tuples(st.just("lookupNode"), st.tuples(CALLERS, NODES)),
    st.tuples(st.just("getPublishedTopics"), st.tuples(CALLERS, st.sampled_from(["", "/ns", "ns/", "~", 5]))),
    st.tuples(
        st.sampled_from(["getTopicTypes", "getSystemState", "getParamNames", "getUri", "getPid"]),
        st.tuples(CALLERS),
    ),
    st.tuples(
        st.sampled_from(["deleteParam", "getParam", "hasParam", "searchParam"]), st.tuples(CALLERS, KEYS)
    ),
    st.tuples(st.just("setParam"), st.tuples(CALLERS, KEYS, VALUES)),
    st.tuples(st.sampled_from(["subscribeParam", "unsubscribeParam"]), st.tuples(CALLERS, URIS, KEYS)),
    st.tuples(
        st.sampled_from(["getParam", "registerPublisher", "getPid", "getSystemState"]),
        st.sampled_from([(), (5,), ("/a", "b", "c", "d", "e", "f")]),
    ),
)


class Oracle:
    """rosmaster's handler; it records the updates that rosmaster's threads would send."""

    def __init__(self):
        self._handler = ROSMasterHandler()
        self._handler._shutdown()  # stops its threads
        self._handler.uri = URI
        self._handler.thread_pool = self._handler.reg_manager.thread_pool = self
        self._sent = []

    def queue_task(self, _marker, task, arguments):
        """Record an update; rosmaster calls this method of its thread pool."""
        match task.__name__, arguments:
            case "publisher_update_task", (uri, topic, uris):
                self._sent.append((uri, "publisherUpdate", topic, uris))
            case "param_update_task", (_, uri, key, value):
                self._sent.append((uri, "paramUpdate", key, value))
            case "shutdown_node_task", (uri, node, _):
                self._sent.append((uri, "shutdown", node, ""))

    def call(self, method, arguments):
        """Return code and value of the response, and the updates in sorted order."""
        self._sent = []
        # The method may change its arguments.
        code, _, value = getattr(self._handler, method)(*copy.deepcopy(arguments))
        return code, plain(value), sorted(self._sent, key=repr)


def plain(value):
    """Return a value as XML-RPC returns it."""
    match value:
        case list() | tuple():
            return [plain(item) for item in value]
        case dict():
            return {key: plain(item) for key, item in value.items()}
    return value


def ours(api, method, arguments):
    """Return the same values as `Oracle.call`, from our API."""
    answer, updates = api.call(method, arguments)
    sent = [(it.uri, it.method, it.subject, "" if it.method == "shutdown" else it.value) for it in updates]
    return answer.code, plain(answer.value), sorted(sent, key=repr)


@given(st.lists(CALLS, max_size=30))
def test_any_sequence_of_calls_has_the_answers_and_updates_of_rosmaster(calls):
    """ROS nodes were written for rosmaster, so they rely on its responses."""
    oracle, api = Oracle(), MasterApi(URI, os.getpid())

    for method, arguments in calls:
        assert ours(api, method, arguments) == oracle.call(method, arguments), (method, arguments)


@pytest.fixture(scope="module")
def rosmaster(tmp_path_factory):
    """Start rosmaster as a process, and yield its URI."""
    program = (
        "import os, sys, threading; from rosmaster.master import Master\n"
        "os.environ['ROS_HOSTNAME'] = 'localhost'; master = Master(0); master.start()\n"
        "print(master.uri, flush=True); sys.stdin.read(); os._exit(0)"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,  # rosmaster logs a traceback for each node without a response
        text=True,
        env={**os.environ, "ROS_LOG_DIR": str(tmp_path_factory.mktemp("log"))},
    )
    yield process.stdout.readline().strip()
    process.communicate()


RECORDED = (
    ("registerService", "/a", "/a/get", "rosrpc://localhost:5", "http://localhost:1/"),
    ("registerPublisher", "/a", "/scan", "sensor_msgs/Range", "http://localhost:1/"),
    ("registerSubscriber", "/b", "/scan", "*", "http://localhost:2/"),
    ("setParam", "/a", "~gain", 2.5),
    (
        "setParam",
        "/b",
        "/robot",
        {"name": "robotino", "wheels": [1, 2, 3], "base": {"width": 0.25, "on": True}},
    ),
    ("getParam", "/b", "/robot/base"),
    ("getParam", "/b", "/"),
    ("searchParam", "/robot/x/y", "base/width"),
    ("getParamNames", "/a"),
    ("getSystemState", "/a"),
    ("getTopicTypes", "/a"),
    ("getPublishedTopics", "/a", ""),
    ("lookupService", "/b", "/a/get"),
    ("lookupService", "/b", "/none"),
    ("lookupNode", "/b", "/a"),
    ("unregisterPublisher", "/a", "/scan", "http://localhost:1/"),
    ("unregisterService", "/a", "/a/get", "rosrpc://localhost:5"),
    ("deleteParam", "/a", "/robot/base"),
    ("getParam", "/a", "/robot"),
    ("getParam",),
    ("noSuchCall", "/a"),
    (
        "system.multicall",
        [{"methodName": "getParam", "params": ["/a", "/robot/name"]}, {"methodName": "no", "params": []}],
    ),
)


def test_recorded_calls_have_the_same_answers_on_the_wire(rosmaster):
    """Clients see codes, values and their types after XML-RPC, so only the status messages may differ."""
    with MasterServer(name="localhost") as master:
        for method, *arguments in RECORDED:
            assert answered(master.uri, method, arguments) == answered(rosmaster, method, arguments), method


def answered(uri, method, arguments):
    """Return code and value of a response, "fault" for a fault, or a list for several responses."""
    try:
        with xmlrpc.client.ServerProxy(uri) as proxy:
            answer = getattr(proxy, method)(*arguments)
    except xmlrpc.client.Fault:
        return "fault"
    if method == "system.multicall":
        return [each[0][::2] if isinstance(each, list) else "fault" for each in answer]
    return answer[::2]


TOOLS = (["rostopic", "list", "-v"], ["rosservice", "list"])


def test_ros_command_lines_print_the_same_with_both_masters(rosmaster):
    """People use these programs to debug.

    `rosnode` and `rosparam` need no test, because they send the same calls.
    """
    calls = [RECORDED[0], RECORDED[1], RECORDED[2]]
    with MasterServer(name="localhost") as master:
        for uri in (master.uri, rosmaster):
            for method, *arguments in calls:
                answered(uri, method, arguments)
        # The programs run at the same time, because each needs a second to start.
        started = [(printing(tool, master.uri), printing(tool, rosmaster)) for tool in TOOLS]
        printed = [[process.communicate(timeout=60)[0] for process in pair] for pair in started]

    assert [ours for ours, _ in printed] == [rosmasters for _, rosmasters in printed]
    assert "sensor_msgs/Range" in printed[0][0]
    assert printed[1][0] == "/a/get\n"


def printing(tool, uri):
    """Start one of ROS's command line programs."""
    environment = {**os.environ, "ROS_MASTER_URI": uri}
    return subprocess.Popen(tool, env=environment, stdout=subprocess.PIPE, text=True)


NODE = """
import sys, time, rospy
from std_msgs.msg import String
rospy.init_node("listener", disable_signals=True)
heard = []
rospy.Subscriber("/chat", String, lambda message: heard.append(message.data))
rospy.set_param("~given", {"list": [1, 2.5, "text"]})
print(rospy.get_param("~given/list"), rospy.search_param("given"), rospy.has_param("/no"), flush=True)
sys.stdin.readline()
publisher = rospy.Publisher("/chat", String, queue_size=1, latch=True)
publisher.publish("hello")
give_up = time.monotonic() + 30
while not heard and time.monotonic() < give_up:
    time.sleep(0.02)
print(heard, rospy.get_published_topics("/"), flush=True)
sys.stdin.readline()
give_up = time.monotonic() + 30
while not rospy.is_shutdown() and time.monotonic() < give_up:
    time.sleep(0.02)
print(rospy.is_shutdown(), flush=True)
"""


def test_rospy_works_with_our_master_and_ends_when_a_node_takes_its_name(tmp_path):
    """A rospy node uses topics and parameters, and obeys the master's `shutdown`, as with rosmaster."""
    with MasterServer(name="localhost") as master:
        environment = {
            "ROS_MASTER_URI": master.uri,
            "ROS_HOSTNAME": "localhost",
            "ROS_LOG_DIR": str(tmp_path),
        }
        with subprocess.Popen(
            [sys.executable, "-c", NODE],
            env={**os.environ, **environment},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        ) as node:
            parameters = node.stdout.readline()
            eventually(lambda: answered(master.uri, "lookupNode", ["/t", "/listener"])[0] == 1)
            node.stdin.write("\n")
            node.stdin.flush()
            topics = node.stdout.readline()
            answered(
                master.uri, "registerService", ["/listener", "/s", "rosrpc://h:1", "http://localhost:1/"]
            )
            ended, _ = node.communicate("\n", timeout=60)

    assert parameters == "[1, 2.5, 'text'] /listener/given False\n"
    assert topics.startswith("['hello'] [[")
    assert "['/chat', 'std_msgs/String']" in topics
    assert ended.endswith("True\n")  # rospy prints a reason before it
