"""A ROS without sockets: tests call services by path, as a client does, and topics keep the sent messages.

Requests and responses are encoded and decoded with the real message types, so a field that the type does not
have is an error here too.
"""

import heapq
import itertools
import math
from collections import deque
from contextlib import nullcontext

import pytest

from palaestra_protocol.ros.rostypes import service_type
from palaestra_sim.ros.node import LATER, ServiceFailed
from palaestra_sim.ros_controller.options import FrontOptions
from palaestra_sim.ros_controller.simulator import RunningSimulator
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.mode import Mode
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin
from tests.scenes import load_scene

PENDING = object()


class FakePublisher:
    """A publisher that puts messages into the inboxes of its topic."""

    def __init__(self, topic, type_name, template, latched, reading):
        self.topic = topic
        self.type_name = type_name
        self.template = template
        self.latched = latched
        self.reading = reading

    @property
    def heard(self):
        """Return whether the topic has a subscriber."""
        return bool(self.topic.inboxes)

    def send(self, fields):
        """Deliver the publisher's template with these fields."""
        self.topic.deliver({**self.template, **fields})

    def send_stamped(self, fields):
        """Deliver the publisher's template with these fields, as `send` does."""
        self.send(fields)

    def send_value(self, value):
        """Deliver the value alone, without the template."""
        self.topic.deliver(value)


class FakeTopic:
    """A topic: its publishers and the inboxes of its subscribers."""

    def __init__(self):
        self.publishers = []
        self.inboxes = []

    def deliver(self, message):
        """Put a message into every inbox."""
        for inbox in self.inboxes:
            inbox.append(message)


class FakeNode:
    """A node for both sides: the controller registers services, and a client uses `call`."""

    def __init__(self, ros, name):
        self.name = name
        self.blocked = lambda: False
        self.current_call = None
        self.services = {}
        self.answers = {}
        self.closed = False
        self._ros = ros
        self._waiting = deque()
        self._calls = itertools.count()

    def serve(self, path, type_name, handler):
        """Register a service; its path must be new."""
        assert path not in self.services, f"{path} served twice"
        self.services[path] = (service_type(type_name), handler)

    def together(self):
        """Return a context that registers nothing."""
        return nullcontext()

    def advertise(self, path, type_name, *, latched=False, template=None, reading=""):
        """Return a publisher of a topic."""
        topic = self._ros.topic(path if path.startswith("/") else f"/{self.name}/{path}")
        publisher = FakePublisher(topic, type_name, dict(template or {}), latched, reading)
        topic.publishers.append(publisher)
        return publisher

    def withdraw(self, publisher):
        """Remove a publisher."""
        publisher.topic.publishers.remove(publisher)

    def answer(self, call, fields):
        """Respond to a deferred call, and then handle the calls that waited behind it."""
        number, type_ = call
        self.answers[number] = _travelled(type_.response, fields)
        self.later(0, self._take_waiting)

    def later(self, delay_s, callback):
        """Schedule a callback for the time when `advance` reaches it."""
        self._ros.later(delay_s, callback)

    def close(self):
        """Mark the node as closed, and remove all services."""
        self.closed = True
        self.services.clear()

    def ask(self, path, **fields):
        """Send a request and return its number; its response appears in `answers`."""
        number = next(self._calls)
        if self.blocked():
            self._waiting.append((number, path, fields))
        else:
            self._handle(number, path, fields)
        return number

    def call(self, path, **fields):
        """Call a service, run callbacks that are due at once, and return the response, or PENDING."""
        number = self.ask(path, **fields)
        self._ros.advance(0)
        answer = self.answers.get(number, PENDING)
        if isinstance(answer, ServiceFailed):
            raise answer
        return answer

    def get(self, path, **fields):
        """Call a service and return the only field of its response."""
        (value,) = self.call(path, **fields)
        return value

    def inbox(self, path):
        """Subscribe to a topic, and return the list that collects its messages."""
        messages = []
        name = path if path.startswith("/") else f"/{self.name}/{path}"
        self._ros.topic(name).inboxes.append(messages)
        return messages

    def publishers(self, path):
        """Return the publishers of a topic below this node's name."""
        return self._ros.topic(f"/{self.name}/{path}").publishers

    def _handle(self, number, path, fields):
        type_, handler = self.services[path]
        self.current_call = (number, type_)
        try:
            answer = handler(_travelled(type_.request, fields))
        except ServiceFailed as error:
            self.answers[number] = error
            return
        if answer is not LATER:
            self.answers[number] = _travelled(type_.response, answer)

    def _take_waiting(self):
        while self._waiting and not self.blocked():
            self._handle(*self._waiting.popleft())


class FakeRos:
    """A ROS with nodes, topics and a clock that only `advance` moves."""

    def __init__(self):
        self.now_s = 100.0
        self.nodes = []
        self._topics = {}
        self._timers = []
        self._order = itertools.count()

    def make_node(self, name):
        """Return a new node."""
        node = FakeNode(self, name)
        self.nodes.append(node)
        return node

    def node(self, name):
        """Return the newest node of that name."""
        return [it for it in self.nodes if it.name == name][-1]

    def topic(self, name):
        """Return a topic by its global name; make it if it is new."""
        return self._topics.setdefault(name, FakeTopic())

    def clock(self):
        """Return the time in seconds."""
        return self.now_s

    def later(self, delay_s, callback):
        """Schedule a callback for the time when `advance` reaches it."""
        heapq.heappush(self._timers, (self.now_s + delay_s, next(self._order), callback))

    def advance(self, duration_s):
        """Move the clock, and run every callback that is due."""
        end_s = self.now_s + duration_s
        while self._timers and self._timers[0][0] <= end_s:
            due_s, _, callback = heapq.heappop(self._timers)
            self.now_s = max(self.now_s, due_s)
            callback()
        self.now_s = end_s


def _travelled(codec, fields):
    return codec.decode(codec.encode(fields))


@pytest.fixture
def ros():
    """Return a ROS without nodes."""
    return FakeRos()


@pytest.fixture
def start(ros, tmp_path):
    """Return `start(world=..., mode=..., options=...)`, which starts a stub and returns its simulator."""

    def begin(world=None, mode=Mode.FAST, **options):
        path = tmp_path / "worlds" / "arena.wbt"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(builtin("arena") if world is None else world)
        simulator = RunningSimulator(
            path,
            Loader(physics=StubPhysics),
            ros.make_node,
            options=FrontOptions(**options),
            mode=mode,
            clock=ros.clock,
        )
        simulator.start()
        return simulator

    return begin


@pytest.fixture
def robot(ros, start):
    """Return the node of the robot in the built-in arena, in fast mode."""
    start()
    return ros.node("robotino")


@pytest.fixture
def two_robots(ros, start):
    """Return the nodes of supervisor and robot, from the built-in world with a separate supervisor."""
    start(builtin("two_robots"))
    return ros.node("supervisor"), ros.node("robotino")


@pytest.fixture
def drive():
    """`drive(node, vx, vy, omega)` commands the wheels over ROS, as the trainer's facade does."""

    def command(node, vx, vy, omega):
        speeds = (
            (vy - 0.1826 * omega) / 0.063,
            (-math.sqrt(0.75) * vx - 0.5 * vy - 0.1826 * omega) / 0.063,
            (math.sqrt(0.75) * vx - 0.5 * vy - 0.1826 * omega) / 0.063,
        )
        for index, speed in enumerate(speeds):
            node.call(f"wheel{index}_joint/set_position", value=math.inf)
            node.call(f"wheel{index}_joint/set_velocity", value=speed)

    return command


@pytest.fixture
def position():
    """`position(node, "ROBOTINO")` returns x, y, z of a node, which ROS finds by its DEF."""

    def ask(node, def_name):
        handle = node.get("supervisor/get_from_def", name=def_name)
        point = node.get("supervisor/node/get_position", node=handle)
        return point.x, point.y, point.z

    return ask


@pytest.fixture
def field(robot):
    """`field("TARGET", "translation")` returns the handle of a field of a node with that DEF."""

    def find(def_name, name):
        node = robot.get("supervisor/get_from_def", name=def_name)
        return robot.get("supervisor/node/get_field", node=node, fieldName=name)

    return find


@pytest.fixture
def world():
    """`world(objects, robot=...)` returns a world file with these nodes and a robot."""

    def write(objects="", robot=ROBOT, info=""):
        return f"#VRML_SIM R2023b utf8\nWorldInfo {{ {info} }}\n{objects}\n{robot}\n".encode()

    return write


def _wheel(index):
    """Return a wheel of the Robotino 3 at 0.1826 m from its center, with radius 0.063 m and a radial axle."""
    azimuth = math.radians(180 + 120 * index)
    c, s = math.cos(azimuth), math.sin(azimuth)
    place = f"{0.1826 * c!r} {0.1826 * s!r} 0.063"
    return f"""HingeJoint {{
      jointParameters HingeJointParameters {{ axis {c!r} {s!r} 0 anchor {place} }}
      endPoint Solid {{ translation {place} rotation 0 0 1 {azimuth!r}
        boundingObject Pose {{ rotation 0 1 0 1.5707963
          children [ Cylinder {{ radius 0.063 height 0.01 }} ] }} }}
      device [ RotationalMotor {{ name "wheel{index}_joint" maxVelocity 137.46 }}
               PositionSensor {{ name "wheel{index}_joint_sensor" }} ] }}"""


ROBOT = f"""DEF ROBOTINO Robot {{
  name "robotino" controller "ros" controllerArgs [ "--name=robotino" "--synchronize" ]
  supervisor TRUE
  children [
    {_wheel(0)} {_wheel(1)} {_wheel(2)}
    DEF IR DistanceSensor {{
      translation 0.2 0 0.05 name "ir1" lookupTable [ 0 1 0, 0.5 0.5 0, 1 0 0 ] }}
    TouchSensor {{
      translation 0 0 0.15 name "touch sensor" boundingObject Cylinder {{ radius 0.2 height 0.2 }} }}
  ]
  boundingObject Pose {{
    translation 0 0 0.15 children [ Cylinder {{ radius 0.2 height 0.2 }} ] }}
  physics Physics {{ }}
}}"""


@pytest.fixture
def simple_robot():
    """Return the text of a robot of radius 0.2 m with one ray, which measures 1 - distance without noise."""
    return ROBOT


@pytest.fixture
def load_with(world, simple_robot):
    """`load_with(sensor, robot=..., info=...)` returns a simulation with that sensor on a robot of seed 7."""

    def begin(sensor, robot="", info="", objects=""):
        text = simple_robot.replace("DEF IR", f"{sensor} DEF IR")
        text = text.replace('name "robotino"', f'{robot} customData "7" name "robotino"', 1)
        return load_scene(world(objects, robot=text, info=info))

    return begin


@pytest.fixture
def node_with(start, world, simple_robot, ros):
    """`node_with(sensor)` returns the node of a robot with that sensor."""

    def begin(sensor):
        start(world(robot=simple_robot.replace("DEF IR", f"{sensor} DEF IR")))
        return ros.node("robotino")

    return begin
