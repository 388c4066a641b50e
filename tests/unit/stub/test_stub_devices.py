"""Each row of the table of devices is tested: reading, sampling, services, publishing and corruption."""

import math
import struct
from array import array
from types import SimpleNamespace

import pytest

from palaestra_protocol.ros.rostypes import message_type, reading_field
from palaestra_protocol.ros.tcpros import LENGTH
from palaestra_sim.faults.corruption import damaged_message
from palaestra_sim.faults.parser import parse
from palaestra_sim.ros.topics import PublishedTopic, Publisher
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.devices.device_type import ROLES
from palaestra_sim.scene.nodes.types import type_number
from palaestra_sim.scene.tree.field_types import field_kinds
from palaestra_sim.scene.tree.write_rules import require_effect

COMMON = {"get_model", "get_name", "get_node_type"}
NAMES_ON_JOINT = {f"get_{role}_name" for role in ROLES}
PUBLISHING = {"enable", "get_sampling_period"}
NAMES = sorted(DEVICES)
SETTINGS = {"Radar": "minRadialSpeed 0 maxRadialSpeed 0"}
SENSORS = [name for name in NAMES if DEVICES[name].sampler is not None]


def written(kind):
    """Return the node of a device as text, with other nodes that the device needs for a reading."""
    node = f'{kind.node} {{ name "device" {SETTINGS.get(kind.node, "")} }}'
    if kind.node == "Radar":
        node += " Solid { translation 2 0 0 radarCrossSection 1 }"
    return f"HingeJoint {{ device {node} }}" if kind.on_joint else node


def numbers(topic, data):
    """Return the numbers of the reading in the frame of a message."""
    reading = reading_field(topic.type_name, topic.reading)
    if reading is None:
        message = message_type(topic.type_name).codec.decode(data[LENGTH.size :])
        return flat(getattr(message, topic.reading))
    layout, behind = reading
    end = len(data) - behind
    return layout.unpack(data[end - layout.size : end])


def flat(value):
    """Return the numbers of a reading: the floats of an image or a cloud, or the last field of a message."""
    if isinstance(value, dict):
        _, value = value.popitem()
    if isinstance(value, bytes):
        return struct.unpack(f"<{len(value) // 4}f", value)
    return tuple(value) if isinstance(value, tuple | list | array) else (value,)


def value_of(topic):
    """Return the current reading for a topic, or the first of several readings."""
    return topic.source.value[0] if topic.many else topic.source.value


@pytest.fixture
def stub(start, world):
    """`stub("GPS")` starts a stub whose robot has one device of that type."""

    def begin(name):
        robot = f"""Robot {{ supervisor TRUE controller "ros"
          controllerArgs [ "--name=robotino" "--synchronize" ] children [ {written(DEVICES[name])} ] }}"""
        return start(world(robot=robot))

    return begin


@pytest.fixture
def device(stub, ros):
    """`device("GPS")` returns the row of the type, the device, and the node of its robot."""

    def begin(name):
        (robot,) = stub(name).simulation.robots
        kind, found = robot.parts.devices.rows["device"]
        if name == "Lidar":
            found.clouded = True  # `enable_point_cloud` does this; one of the topics needs it
        return kind, found, ros.node("robotino")

    return begin


@pytest.mark.parametrize("name", NAMES)
def test_a_device_is_listed_and_serves_what_its_row_has(device, name):
    """A client must find exactly the services of the row, and those that each device has."""
    kind, found, node = device(name)

    served = {path.partition("/")[2] for path in node.services if path.startswith("device/")}

    below = f"{kind.sensor}/" if kind.sensor else ""
    publishing = {f"{below}{name}" for name in PUBLISHING} if kind.topics(found) else set()
    neighbors = NAMES_ON_JOINT - {f"get_{kind.role}_name"} if kind.on_joint else set()
    assert served == COMMON | publishing | neighbors | {path for path, _, _ in kind.services(found)}
    assert node.get("robot/get_device_list") == ["device"]
    assert node.get("device/get_name") == "device"
    assert node.get("device/get_node_type") == type_number(name) > 0


@pytest.mark.parametrize("name", NAMES)
def test_its_node_has_the_fields_of_webots(name):
    """A supervisor finds such a field by name, even if the world file does not set it."""
    kinds = field_kinds(name)

    assert kinds["name"].default == DEVICES[name].name
    assert len(kinds) > 1 or name == "Brake", "a Brake has no field of its own"


@pytest.mark.parametrize("name", [name for name in NAMES if DEVICES[name].fields])
def test_a_write_to_a_field_that_is_read_at_the_start_is_refused(stub, name):
    """If the write succeeded, the client would believe that it changed the world."""
    tree = stub(name).simulation.tree
    node = next(it for it in tree.nodes.values() if it.type_name == name)
    *_, field = field_kinds(name)

    with pytest.raises(UnsimulatedError, match=f"{name}.{field} cannot be changed while"):
        require_effect(node, field)


@pytest.mark.parametrize("name", NAMES)
def test_the_name_of_a_device_may_be_written(stub, name):
    """As in Webots, the running controller still uses the first name of the device."""
    tree = stub(name).simulation.tree

    require_effect(next(it for it in tree.nodes.values() if it.type_name == name), "name")


@pytest.mark.parametrize("name", SENSORS)
def test_a_sensor_has_a_value_after_a_step_and_publishes_all_its_topics(device, name):
    """A sensor whose row has no sampler would publish NaN for ever."""
    kind, found, node = device(name)
    inboxes = [node.inbox(f"device/{topic.name}") for topic in kind.topics(found)]

    assert node.get("device/enable", value=32) is True
    node.call("robot/time_step", value=32)

    assert inboxes
    for topic, (sent,) in zip(kind.topics(found), inboxes, strict=True):
        value = sent[topic.reading] if topic.reading else sent
        assert not any(map(math.isnan, flat(value)))


@pytest.mark.parametrize("name", SENSORS)
def test_enable_0_ends_all_topics(device, name):
    """A client disables a sensor before it sets another period, so all its publishers must go."""
    kind, found, node = device(name)
    node.call("device/enable", value=64)
    assert node.get("device/get_sampling_period") == 64

    node.call("device/enable", value=0)

    assert node.get("device/get_sampling_period") == 0
    assert not any(node.publishers(f"device/{topic.name}") for topic in kind.topics(found))


@pytest.mark.parametrize("name", SENSORS)
def test_the_message_of_each_topic_has_its_reading_where_its_row_says(device, name):
    """A reading written at a wrong position would overwrite other fields of the message."""
    kind, found, node = device(name)
    node.call("device/enable", value=32)
    node.call("robot/time_step", value=32)

    for topic in kind.topics(found):
        link = SimpleNamespace(sent=[])
        link.send_newest = link.sent.append
        type_ = message_type(topic.type_name)
        wire = PublishedTopic("/device", type_, latched=False)
        wire.links.append(link)
        publisher = Publisher(wire, dict(topic.constants))
        value = value_of(topic)
        if topic.whole or topic.reading:
            publisher.send_stamped(value if topic.whole else {topic.reading: value})
        else:
            publisher.send_value(value)
        (data,) = link.sent

        assert numbers(topic, data) == pytest.approx(flat(value))
        type_.codec.decode(data[LENGTH.size :])


@pytest.mark.parametrize("name", SENSORS)
def test_a_wrong_value_reaches_each_fraction_of_a_reading(device, name):
    """If the corruption missed a float of a reading, a requested fault would have no effect."""
    kind, found, _ = device(name)

    for topic in kind.topics(found):
        shape = dict(topic.constants)
        if reading_field(topic.type_name, topic.reading) is None:
            shape[topic.reading] = value_of(topic)
        sound = message_type(topic.type_name).codec.frame(shape)
        wrong = damaged_message(topic.type_name, sound, parse("wrong_value", "test"), topic.reading)

        fractions = [it for it in numbers(topic, wrong) if isinstance(it, float)]
        assert all(map(math.isnan, fractions))
        assert (wrong == sound) is (not fractions)


@pytest.mark.parametrize("name", SENSORS)
def test_its_publishers_know_the_field_of_the_reading(stub, ros, name):
    """The fault of a wrong value needs the field, because gyro and accelerometer share a message type."""
    (robot,) = stub(name).simulation.robots
    kind, found = robot.parts.devices.rows["device"]
    node = ros.node("robotino")

    node.call("device/enable", value=32)

    for topic in kind.topics(found):
        (publisher,) = node.publishers(f"device/{topic.name}")
        assert publisher.reading == topic.reading
