"""The definition of a row in the table of devices, and of a device of that type.

This module does not depend on a wire protocol: services are data (`ros_interfaces`), and a message consists
of its type and its fields.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Generic, Protocol, TypeVar

from palaestra_sim.ros_interfaces import Fields, Row, is_ros_name, topic_name
from palaestra_sim.scene.bodies import Body
from palaestra_sim.scene.camera_interface import CameraInterface, Lens
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose, Vector
from palaestra_sim.scene.joints import Joint, JointFrame
from palaestra_sim.scene.links import Link, frames_between
from palaestra_sim.scene.motion import Motion
from palaestra_sim.scene.motors import Motor
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.sensor_rays import Beam
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.scene.validation import NodeReader
from palaestra_sim.scene.visual_rays import Glance


class Device(Protocol):
    """A device of a robot. A sensor also has a `value`, which its sampler sets."""

    @property
    def name(self) -> str:
        """The name of the device in the world file."""
        ...

    @property
    def model(self) -> str:
        """The field `model` of the device's node."""
        ...


DeviceT = TypeVar("DeviceT", bound=Device)


ROLES: Final = ("motor", "brake", "position_sensor")  # the roles of the devices of a joint


@dataclass(slots=True, kw_only=True, eq=False)
class Shaft:
    """A joint, for the devices on it.

    Attributes:
        joint: the joint itself; None for a device that is not on a joint.
        motor: the first motor on the joint; None if it has no motor.
        names: for each role, the name of the first device.
    """

    joint: Joint | None = None
    motor: Motor | None = None
    names: dict[str, str] = field(default_factory=dict)

    @property
    def type_number(self) -> int:
        """The response of `get_type` of the joint's devices: 0 for a hinge, 1 for a slider."""
        return int(self.joint is not None and self.joint.slides)

    @property
    def position(self) -> float:
        """The position of the joint, in rad or m."""
        if self.motor is not None:
            return self.motor.angle_rad
        return 0.0 if self.joint is None else self.joint.now


@dataclass(slots=True, kw_only=True)
class DevicePart:
    """The node of a device, as the reader of its robot passes it to `DeviceType.read`.

    Attributes:
        reading: the reader of the world's nodes.
        lacks: records that a node of the robot cannot be simulated.
        node: the node of the device.
        name: the name of the device in the world file, or else the default name of its type.
        place: the device's frame, in the robot's frame; for a device on a joint, the frame of the joint.
        shaft: the joint on which the device is; None if the device is not on a joint.
        shapes: the shapes of the device's boundingObject; empty for a device that collides with nothing.
        measured: the links whose force on the robot is measured.
        forces: whether the physics has forces.
    """

    reading: NodeReader
    node: SceneNode
    lacks: Callable[[SceneNode, str], None]
    name: str
    place: Frame
    shaft: Shaft | None
    shapes: Sequence[Shape]
    measured: list[Link]
    forces: bool

    @property
    def mount(self) -> Frame | None:
        """The frame of the innermost joint around the device; None if no joint moves the device."""
        return next((frame for frame in self.place.chain() if isinstance(frame, JointFrame)), None)

    def mounted(self, place: Frame) -> Pose:
        """Return the pose of a frame of the device in its mount; without a mount, in the robot's frame."""
        return place.world_pose if self.mount is None else frames_between(self.mount, place)

    def number(self, name: str, default: float) -> float:
        """Return the number of a field; `default` if the field is refused."""
        return self.reading.number(self.node, name, default)

    def text(self, name: str, default: str = "") -> str:
        """Return the text of a field; `default` if it is absent."""
        return self.node.text(name) or default

    def inner(self, name: str) -> SceneNode | None:
        """Return the node in a field; None if the field is NULL."""
        return next(iter(self.node.nodes(name)), None)

    def world_numbers(self, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return the numbers of a field of WorldInfo; `default` if it is absent or refused."""
        world_info = self.reading.world_info
        return default if world_info is None else self.reading.vector(world_info, name, default)

    def world_text(self, name: str, default: str) -> str:
        """Return the text of a field of WorldInfo; `default` if it is absent."""
        world_info = self.reading.world_info
        return default if world_info is None else world_info.text(name) or default

    def axis_to(self, letter: str) -> int:
        """Return the axis of the world, 0 to 2, that points up, north or east: `U`, `N` or `E`."""
        return self.reading.system.index(letter)

    def refuse(self, fact: str, remedy: str) -> None:
        """Record a mistake in the world."""
        self.reading.refuse(self.node, fact, remedy)

    def lack(self, fact: str) -> None:
        """Record that this device cannot be simulated."""
        self.lacks(self.node, fact)

    def measure(self) -> Link:
        """Return this device's link, after adding it to the links whose force on the robot is measured."""
        link = Link(node=self.node, place=self.place, joint=None)
        self.measured.append(link)
        return link


class Carrier(Protocol):
    """The interface of the robot that carries a device.

    Attributes:
        body: the robot's body in the physics; None if the robot cannot drive and is not a free-standing
            obstacle.
        time_s: the time of the world since its start or its last reset.
        resets: the number of resets of the world.
    """

    body: Body | None
    time_s: float
    resets: int

    def gauss(self, mean: float, deviation: float, /) -> float:
        """Return the next number of the robot's own noise."""
        ...

    def look(self, beams: Sequence[Beam], mount: Frame | None = None) -> Callable[[], Sequence[float]]:
        """Return a function that returns the distance in meters that each beam travels.

        The beams are in the frame `mount`; without it, they are in the robot's frame.
        """
        ...

    def see(self, beams: Sequence[Beam], mount: Frame | None = None) -> Callable[[], Sequence[float]]:
        """Return a function like `look`; but the beams stop at visible shapes, except those of the robot."""
        ...

    def reflect(self, beams: Sequence[Beam], mount: Frame | None = None) -> Callable[[], Sequence[Glance]]:
        """Return a function that returns the surface that each infra-red beam meets; see `look`."""
        ...

    def lights(self) -> Sequence[SceneNode]:
        """Return the current lights of the world."""
        ...

    def eye(self, place: Frame, lens: Lens) -> CameraInterface | None:
        """Return a camera at a frame; None if this simulator does not render."""
        ...

    def device(self, name: str) -> object | None:
        """Return one of the robot's devices; None if no device has that name."""
        ...

    def motion(self, place: Frame) -> Motion:
        """Return the motion in the world of a frame on the robot."""
        ...

    def follow(self, place: Frame) -> Callable[[], Vector]:
        """Return a function that returns the acceleration of a frame, in world axes, in m/s2."""
        ...


class ValueSource(Protocol):
    """A sensor, or a part of a sensor, with a value that a topic publishes."""

    @property
    def value(self) -> Any:
        """The value of the last step: a number, or as many numbers as the message's last field has."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceTopic:
    """A topic of one device.

    Attributes:
        name: the name of the topic, relative to the device's name.
        type_name: the type of the messages.
        source: the source of the reading; None if the topic never has a reading.
        constants: the values of the other fields.
        reading: the field of the value. "" means the last field, which must consist of numbers; "" is the
            fastest choice.
        many: whether `value` is a sequence; each of its items is sent in a separate message.
        whole: whether the value is a mapping of all fields except the header.
        stamped: whether the messages begin with a header; without a header, `reading` must name the field.
    """

    name: str
    type_name: str
    source: ValueSource | None
    constants: Fields = field(default_factory=dict)
    reading: str = ""
    many: bool = False
    whole: bool = False
    stamped: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Stream:
    """Topics of a device with their own `enable`, in addition to the `enable` of the device.

    Attributes:
        prefix: the prefix of `enable` and `get_sampling_period`, relative to the name of the device.
        topics: the topics that this `enable` starts.
        silent: whether all periods are refused.
        enabled: called with the new sampling period in ms after a change; 0 means off.
    """

    prefix: str
    topics: tuple[DeviceTopic, ...]
    silent: bool
    enabled: Callable[[int], None]


Sample = Callable[[], None]
Enable = Callable[[int, int], bool]  # period and step in ms; returns whether the period is accepted


def whole_steps(period_ms: int, step_ms: int) -> bool:
    """Return whether the period is a multiple of the duration of the controller's last step."""
    return period_ms % step_ms == 0


def never(_period_ms: int, _step_ms: int) -> bool:
    """Refuse every period: in Webots this device publishes readings, but here it does not."""
    return False


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceType(Generic[DeviceT]):
    """A row of the table: one type of device.

    Attributes:
        node: the type of the device's node.
        name: the name of a device whose node has no name.
        fields: the fields of the node, in the syntax of `field_types`, without `name`, and, if the node is a
            Solid, without the fields that every Solid has.
        without_effect: the names, separated by spaces, of the fields that have an effect in Webots but in no
            simulator of this package.
        solid: whether a node that is not on a joint is a Solid.
        role: one of `ROLES` for a device of a joint; "" for a device with its own frame on the robot.
        read: returns the device of a node.
        sampler: returns a function that sets the values of one robot's devices; None if they have no values.
        services: returns the services that only this type has. Every device also has `get_model`, `get_name`
            and `get_node_type`. A device of a joint also has services for the names of the joint's other
            devices. A device with topics also has `enable` and `get_sampling_period`.
        topics: returns the topics that `enable` starts.
        streams: returns the other topics, each with its own `enable`.
        attach: connects a device to the robot that carries it.
        enable: returns whether a period is accepted; 0, which stops publishing, is always accepted.
        silent: returns whether an attached device has no readings, so that all periods are refused.
        enabled: called with a device and its new sampling period in ms after a change; 0 means off.
        sensor: a prefix of the paths of `enable` and of the topics, after the name of the device; "" for no
            prefix.
    """

    node: str
    name: str
    fields: str
    without_effect: str = ""
    solid: bool = True
    role: str = ""
    read: Callable[[DevicePart], DeviceT]
    sampler: Callable[[Sequence[DeviceT], Carrier], Sample] | None = None
    services: Callable[[DeviceT], Iterable[Row]] = lambda _: ()
    topics: Callable[[DeviceT], tuple[DeviceTopic, ...]] = lambda _: ()
    streams: Callable[[DeviceT], tuple[Stream, ...]] = lambda _: ()
    attach: Callable[[DeviceT, Carrier], None] = lambda _device, _robot: None
    enable: Enable = whole_steps
    silent: Callable[[DeviceT], bool] = lambda _: False
    enabled: Callable[[DeviceT, int], None] = lambda _device, _period_ms: None
    sensor: str = ""

    def accepts(self, device: DeviceT) -> Enable:
        """Return the rule by which a device accepts a sampling period."""
        return never if self.silent(device) else self.enable

    @property
    def on_joint(self) -> bool:
        """Whether the device is a device of a joint."""
        return bool(self.role)

    @property
    def body(self) -> bool:
        """Whether the device's node is a Solid, with which other objects may collide."""
        return self.solid and not self.on_joint


@dataclass(slots=True, kw_only=True, eq=False)
class Devices:
    """All devices of a robot by name, in the order of the world file.

    Attributes:
        rows: for each name, the row of the table, and the device.
        nodes: the nodes of the devices, by name.
        shafts: the joints of the devices on joints, by name.
    """

    rows: dict[str, tuple[DeviceType[Any], Any]] = field(default_factory=dict)
    nodes: dict[str, SceneNode] = field(default_factory=dict)
    shafts: dict[str, Shaft] = field(default_factory=dict)
    _by_topic: dict[str, str] = field(default_factory=dict)

    def add(self, name: str, kind: DeviceType[Any], device: Any) -> None:
        """Add a device, or replace the device of the same name."""
        self.rows[name] = kind, device
        self._by_topic[topic_name(name)] = name

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the devices."""
        return tuple(self.rows)

    @property
    def motors(self) -> dict[str, Motor]:
        """The motors."""
        return {name: it for name, (_, it) in self.rows.items() if isinstance(it, Motor)}

    @property
    def sensors(self) -> Mapping[str, ValueSource]:
        """The devices that have a value."""
        return {name: it for name, (kind, it) in self.rows.items() if kind.sampler is not None}

    def trouble_with(self, name: str) -> str | None:
        """Return the reason to refuse another device of the name `name`; None to accept the device."""
        if name in self.rows:
            return f"a second device {name!r}"
        if not is_ros_name(name):
            return f"a device {name!r}, whose name ROS does not accept"
        path = topic_name(name)
        same = self._by_topic.get(path)
        return None if same is None else f"devices {same!r} and {name!r}, whose topics are both {path!r}"

    def of(self, kind: DeviceType[DeviceT]) -> tuple[DeviceT, ...]:
        """Return the devices of one type."""
        return tuple(device for found, device in self.rows.values() if found is kind)
