"""What all devices of a robot share: their services, and the facts that the robot's controller returns.

A fact is declared in one line: the name of a service, and the meaning of the value with its unit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, Never, Self, TypeVar, overload

from palaestra_trainer.webots.services import Services

Value = TypeVar("Value")

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
    """

    __slots__ = ("_path", "_services", "device", "robot")

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
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        return self._services.get(f"{self._path}/{service}", type_name)(**request)

    def _command(self, service: str, type_name: str, **request: Any) -> None:
        """Call a service of the device that only confirms; see `Services.confirm`."""
        given = ", ".join(f"{field} {value!r}" for field, value in request.items())
        refused = f"{self.device} refuses {service} with {given}"
        self._services.confirm(f"{self._path}/{service}", type_name, refused, **request)

    def _require_kept(self, what: str, wanted: float, actual: float) -> None:
        """Check that the simulator has set a value that it confirmed; see `Services.require_kept`."""
        self._services.require_kept(self.device, what, wanted, actual)


class Fact(Generic[Value]):
    """An attribute of a device whose value the controller returns; each use sends one request.

    Using it may raise SimulatorDead, SimulatorHung or WrongData, as `RosService`.

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
        self._type_name = type_name
        self._read = read
        self.__doc__ = doc

    @overload
    def __get__(self, device: None, owner: type[Device]) -> Self: ...

    @overload
    def __get__(self, device: Device, owner: type[Device]) -> Value: ...

    def __get__(self, device: Device | None, owner: type[Device]) -> Self | Value:
        """Return the value; on a class, return this declaration."""
        if device is None:
            return self
        return self._read(device.call(self.service, self._type_name, ask=True))

    def __set__(self, device: Device, value: Never) -> None:
        """Refuse: the value belongs to the simulator."""
        raise AttributeError(
            f"{self.service} of {device.device} cannot be set; the class has methods that set"
        )


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


_LINEAR = 1  # the type of a device of a sliding joint; 0 is a turning joint. Source: webots/motor.h
