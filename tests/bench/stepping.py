"""Environment steps over ROS, by Palaestra's clients and by rospy in turns.

One step consists of three wheel commands, one time_step, nine distances, the bumper and the pose.
"""

import itertools
import statistics
import threading
import time
import xmlrpc.client

import genpy
import rosgraph
import rospy

from palaestra_protocol.ros.rostypes import service_type
from tests.bench.arena import running
from tests.bench.sizes import scaled
from tests.waiting import eventually

ROUNDS = 5
OURS = 1000
ROSPYS = 60
PERIOD_MS = 192
TOPICS = [*(f"ir{number}" for number in range(1, 10)), "touch_sensor"]


def measure(scale=1.0):
    """Return the steps per second with each client, and the median of the rounds' ratios."""
    with running() as (robot, _, _):
        pairs = [(rate_of_ours(robot, scale), rate_of_rospy(scale)) for _ in range(scaled(ROUNDS, scale))]
    return {
        "steps_per_second": round(statistics.median(ours for ours, _ in pairs)),
        "rospy_steps_per_second": round(statistics.median(rospys for _, rospys in pairs)),
        "times_rospy": round(statistics.median(ours / rospys for ours, rospys in pairs), 1),
    }


def rate_of_ours(robot, scale):
    """Return the steps per second of Palaestra's clients while rospy is not connected."""
    robot.connect()
    ways = itertools.cycle((1.0, -1.0))
    found = rate(lambda: step(robot, next(ways)), scaled(OURS, scale))
    robot.close()
    return found


def rate_of_rospy(scale):
    """Return the steps per second of rospy while Palaestra's clients are not connected."""
    stepper = RospyStepper("robotino")
    found = rate(stepper.step, scaled(ROSPYS, scale))
    stepper.close()
    return found


def rate(step_once, count):
    """Return the number of calls of `step_once` per second."""
    started = time.perf_counter()
    for _ in range(count):
        step_once()
    return count / (time.perf_counter() - started)


def step(robot, way):
    """Take one step with Palaestra's client.

    `way` is 1 or -1, the direction of every wheel. The caller alternates it, because the client does not send
    an unchanged command again.
    """
    robot.drive(way * 0.3, way * 0.1, way * 0.5)
    robot.advance()
    robot.pose()


class RospyStepper:
    """Takes the same step as a rospy program does, with a proxy per service and a subscriber per topic.

    Args:
        name: the ROS name of the robot, whose sensors are enabled.
        persistent: whether each proxy keeps its connection; otherwise it opens a new one for each call.
    """

    def __init__(self, name, *, persistent=False):
        self._calls = [
            *(
                proxy(f"/{name}/wheel{number}_joint/set_velocity", "set_float", persistent=persistent)
                for number in range(3)
            ),
            proxy(f"/{name}/robot/time_step", "set_int", persistent=persistent),
        ]
        self._pose = [
            proxy(f"/{name}/supervisor/node/{call}", f"node_{call}", persistent=persistent)
            for call in ("get_position", "get_orientation")
        ]
        self._node = proxy(f"/{name}/supervisor/get_from_def", "supervisor_get_from_def")(name="ROBOTINO")
        self._arrived = threading.Semaphore(0)
        self._subscribers = [
            rospy.Subscriber(f"/{name}/{topic}/value", rospy.AnyMsg, self._count) for topic in TOPICS
        ]
        self._publisher = xmlrpc.client.ServerProxy(rosgraph.Master(rospy.get_name()).lookupNode(f"/{name}"))
        wanted = {subscriber.resolved_name for subscriber in self._subscribers}
        eventually(lambda: self._connected() == wanted)

    def step(self):
        """Take one step."""
        for wheel in self._calls[:3]:
            wheel(value=1.0)
        self._calls[3](value=PERIOD_MS)
        for call in self._pose:
            call(node=self._node.value.node)
        for _ in TOPICS:
            if not self._arrived.acquire(timeout=5):
                raise TimeoutError("a sensor published no message within 5 s")

    def close(self):
        """Unsubscribe, and wait until the simulator has closed the connections.

        The next `RospyStepper` uses the same node name.
        """
        for call in (*self._calls, *self._pose):
            call.close()
        for subscriber in self._subscribers:
            subscriber.unregister()
        eventually(lambda: not self._connected())
        self._publisher("close")()

    def _connected(self):
        """Return the topics whose publisher has connected to this node, as the simulator reports them.

        rospy's own number of connections is not used, because rospy counts a connection too early.
        """
        links = self._publisher.getBusInfo(rospy.get_name())[2]
        return {topic for _, subscriber, _, _, topic, _ in links if subscriber == rospy.get_name()}

    def _count(self, _message):
        self._arrived.release()


def proxy(name, type_name, *, persistent=False):
    """Return rospy's proxy of a webots_ros service; like most programs, it opens a connection per call."""
    type_ = service_type(f"webots_ros/{type_name}")
    service = type(
        type_name,
        (),
        {
            "_type": type_.name,
            "_md5sum": type_.md5,
            "_request_class": message(f"{type_.name}Request", type_.request),
            "_response_class": message(f"{type_.name}Response", type_.response),
        },
    )
    return rospy.ServiceProxy(name, service, persistent=persistent)


def message(name, codec):
    """Return a class that rospy can send and receive."""

    class Message(genpy.Message):
        __slots__ = ("fields", "value")
        _type = name

        def __init__(self, **fields):
            self.fields = fields

        def serialize(self, buffer):
            buffer.write(codec.encode(self.fields))

        def deserialize(self, data):
            self.value = codec.decode(bytes(data))
            return self

    return Message
