"""Devices of a robot: their services, and the facts that the robot's controller returns.

A fact is declared in one line: the name of a service, and the meaning of the value with its unit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar, Generic, Never, Self, TypeVar, overload

from palaestra_trainer.errors import SimulatorDead, SimulatorFault, WorldMisfit
from palaestra_trainer.webots.node_types import NODE_TYPES
from palaestra_trainer.webots.services import Services

Value = TypeVar("Value")

_LINEAR = 1  # the type of a device of a sliding joint; 0 is a turning joint. Source: webots/motor.h
# Webots replaces only these characters when it converts a device's name to a path.
_REPLACED = str.maketrans("-. ()", "_____")


def topic_name(device: str) -> str:
    """Return the device's name as it is in ROS paths, e.g. touch_sensor for "touch sensor"."""
    return device.translate(_REPLACED)


class Device:
    """A device of a robot, or a part of its controller that has services as a device has.

    Args:
        robot: the ROS name of the robot's controller.
        device: the device's name in the world, e.g. ir1

    Attributes:
        robot: see above.
        device: see above.
        nodes: the types of nodes that the class is for; empty if it is not for nodes of Webots.
    """

    __slots__ = ("_path", "_services", "device", "robot")
    nodes: ClassVar[tuple[str, ...]] = ()

    def __init__(self, robot: str, device: str) -> None:
        self.robot = robot
        self.device = device
        self._path = topic_name(device)
        self._services = Services(robot)

    def close(self) -> None:
        """Close the connections."""
        self._services.close()

    def call(self, service: str, type_name: str, **request: Any) -> Any:
        """Call a service of the device and return the response, an object with the fields of its type.

        Args:
            service: the name of the service, below the name of the device.
            type_name: the name of its type in webots_ros.
            request: the fields of the request.

        Raises:
            WorldMisfit: the device is another type of node in the world.
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        with self._explaining():
            return self._services.get(f"{self._path}/{service}", type_name)(**request)

    def ask_once(self, service: str, type_name: str) -> Any:
        """Call a service without arguments as `call` does, without a connection that stays open."""
        with self._explaining():
            return self._services.call_once(f"{self._path}/{service}", type_name, ask=True)

    def explained(self, fault: SimulatorFault) -> SimulatorFault:
        """Return the reason of a fault: a `WorldMisfit` if the device is another node in the world.

        Such a device lacks some of the services. Without this check, the fault would look like a dead
        simulator.
        """
        found = self._node_in_world() if self.nodes else ""
        if not found or found in self._wanted_nodes():
            return fault
        wanted = " or ".join(self._wanted_nodes())
        return WorldMisfit(
            self.robot,
            f"{self.device} is a {found} in the world, and {type(self).__name__} is for a {wanted};"
            f" use the class for a {found}, or name another device",
        )

    @contextmanager
    def _explaining(self) -> Iterator[None]:
        """Replace a `SimulatorDead` by its reason; see `explained`."""
        try:
            yield
        except SimulatorDead as error:
            raise self.explained(error) from None

    def _wanted_nodes(self) -> tuple[str, ...]:
        return self.nodes

    def _node_in_world(self) -> str:
        """Return the type of the device's node; "" if it is not known."""
        try:
            answer = self._services.call_once(f"{self._path}/get_node_type", "get_int", ask=True)
        except SimulatorFault:
            return ""
        return NODE_TYPES.get(int(answer.value), "")

    def _command(self, service: str, type_name: str, **request: Any) -> None:
        """Call a service of the device that only confirms; see `Services.confirm`."""
        given = ", ".join(f"{field} {value!r}" for field, value in request.items())
        refused = f"{self.device} refuses {service} with {given}"
        with self._explaining():
            self._services.confirm(f"{self._path}/{service}", type_name, refused, **request)

    def _require_kept(self, what: str, wanted: float, actual: float) -> None:
        """Check that the simulator has set a value that it confirmed; see `Services.require_kept`."""
        self._services.require_kept(self.device, what, wanted, actual)


class Fact(Generic[Value]):
    """An attribute of a device whose value the controller returns; each use sends one request.

    No connection stays open. Using it may raise WorldMisfit, SimulatorDead, SimulatorHung or WrongData, as
    `Device.call`.

    Args:
        service: the name of the service, below the name of the device.
        type_name: the name of its type in webots_ros.
        read: a function that returns the value in the response.
        doc: the meaning of the value, with its unit.

    Attributes:
        service: see above.
    """

    def __init__(self, service: str, type_name: str, read: Callable[[Any], Value], doc: str) -> None:
        self.service = service
        self._name = service
        self._type_name = type_name
        self._read = read
        self.__doc__ = doc

    def __set_name__(self, owner: type[Device], name: str) -> None:
        """Note the name of the attribute for errors."""
        self._name = name

    @overload
    def __get__(self, device: None, owner: type[Device]) -> Self: ...

    @overload
    def __get__(self, device: Device, owner: type[Device]) -> Value: ...

    def __get__(self, device: Device | None, owner: type[Device]) -> Self | Value:
        """Return the value; on a class, return this declaration."""
        if device is None:
            return self
        return self._read(device.ask_once(self.service, self._type_name))

    def __set__(self, device: Device, value: Never) -> None:
        """Refuse: the value belongs to the simulator."""
        raise AttributeError(f"{self._name} of {device.device} is read-only")


def number_fact(service: str, doc: str) -> Fact[float]:
    """Declare a fact of the type webots_ros/get_float."""
    return Fact(service, "get_float", lambda response: float(response.value), doc)


def whole_fact(service: str, doc: str) -> Fact[int]:
    """Declare a fact of the type webots_ros/get_int."""
    return Fact(service, "get_int", lambda response: int(response.value), doc)


def flag_fact(service: str, doc: str) -> Fact[bool]:
    """Declare a fact of the type webots_ros/get_bool."""
    return Fact(service, "get_bool", lambda response: bool(response.value), doc)


def text_fact(service: str, doc: str) -> Fact[str]:
    """Declare a fact of the type webots_ros/get_string."""
    return Fact(service, "get_string", lambda response: str(response.value), doc)


def lookup_table_fact() -> Fact[tuple[tuple[float, float, float], ...]]:
    """Declare the lookup table of a sensor."""
    return Fact(
        "get_lookup_table",
        "get_float_array",
        _rows,
        "The rows of the lookup table: a measured value, the output for it, and the noise. Empty: no table.",
    )


def named(service: str, names: Sequence[str], doc: str) -> Fact[str]:
    """Declare a fact whose number, of the type webots_ros/get_int, is the index of a name in `names`."""

    def name_of(response: Any) -> str:
        number = int(response.value)
        return names[number] if 0 <= number < len(names) else f"unknown type {number}"

    return Fact(service, "get_int", name_of, doc)


def _rows(response: Any) -> tuple[tuple[float, float, float], ...]:
    numbers = iter(response.value)
    return tuple(zip(numbers, numbers, numbers, strict=True))


class NodeDevice(Device):
    """A device that is a node of the world, in contrast to the keyboard, for example."""

    __slots__ = ()
    model = text_fact("get_model", "The field `model` of the device's node.")
    node_type = whole_fact("get_node_type", "The number of the node's type in Webots, such as 44 for a GPS.")


class JointDevice(NodeDevice):
    """A device of a joint, such as a motor."""

    __slots__ = ()
    slides = Fact(
        "get_type",
        "get_int",
        lambda response: response.value == _LINEAR,
        "Whether the joint slides, so that its positions are in m, or it turns, with positions in rad.",
    )
