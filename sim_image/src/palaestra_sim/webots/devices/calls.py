"""The common parts of all devices: the functions of one device, rows of services, and values of topics."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Protocol

from palaestra_sim.ros_controller.served_robot import ServedDevice
from palaestra_sim.ros_interfaces import Row, topic_name
from palaestra_sim.scene.devices.device_type import DeviceTopic, Stream
from palaestra_sim.webots.library import Library

_DONE: Final = {"success": True}


class Calls(Protocol):
    """Functions of libController whose names begin alike; an attribute has the rest of the name."""

    def __getattr__(self, name: str) -> Callable[..., Any]:
        """Return a function, such as `get_model`."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class InputCalls:
    """The functions for an input of the robot: `calls.get_model()` calls `wb_<kind>_get_model()`.

    Attributes:
        library: the library of Webots.
        kind: the part of the functions' names that names the input, such as "joystick".
    """

    library: Library
    kind: str

    def __getattr__(self, name: str) -> Callable[..., Any]:
        """Return a function of the input, such as `get_model`."""
        function: Callable[..., Any] = getattr(self.library, f"{self.kind}_{name}")
        return function


@dataclass(frozen=True, slots=True, eq=False)
class DeviceCalls:
    """The functions of libController for one device: `calls.get_value()` calls `wb_<kind>_get_value(tag)`.

    Attributes:
        library: the library of Webots.
        kind: the part of the functions' names that names the type of the device, such as "distance_sensor".
        tag: the number of the device in the library.
    """

    library: Library
    kind: str
    tag: int

    def __getattr__(self, name: str) -> Callable[..., Any]:
        """Return a function of the device, such as `get_value`."""
        return partial(getattr(self.library, f"{self.kind}_{name}"), self.tag)

    @property
    def name(self) -> str:
        """The name of the device in the world."""
        text: str = self.library.device_get_name(self.tag)
        return text

    def name_of(self, neighbor: str) -> str:
        """Return the name of the motor, brake or sensor on the same joint; "" if the joint lacks it."""
        tag = getattr(self, f"get_{neighbor}")()
        return self.library.device_get_name(tag) if tag else ""


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """A value that a topic publishes; it is read when it is published."""

    read: Callable[[], Any]

    @property
    def value(self) -> Any:
        """The value of the last step."""
        return self.read()


def vector(read: Callable[[], tuple[float, ...] | None], length: int = 3) -> Reading:
    """Return the reading of an array; NULL, which stands for no measurement, becomes NaN."""
    missing = (math.nan,) * length
    return Reading(lambda: read() or missing)


def served(
    calls: DeviceCalls,
    *,
    topics: Sequence[DeviceTopic] = (),
    rows: Iterable[Row] = (),
    sensor: str = "",
    streams: tuple[Stream, ...] = (),
    camera: str = "",
) -> ServedDevice:
    """Return a device as the controller serves it.

    Args:
        calls: the functions of the device.
        topics: the topics that the service `enable` starts.
        rows: the services that only this type of device has.
        sensor: the name of the sensor in a device that is more than a sensor: its functions are
            `enable_<sensor>` and `disable_<sensor>`, its paths are below `<sensor>_sensor/`; "" otherwise.
        streams: topics with their own `enable`.
        camera: the name of a camera, whose first topic has pictures for viewers.
    """
    library, tag = calls.library, calls.tag
    return ServedDevice(
        path=topic_name(calls.name),
        topics=tuple(topics),
        enabled=switch(calls, sensor and f"_{sensor}"),
        prefix=sensor and f"{sensor}_sensor/",
        rows=(
            ("get_model", "get_string", lambda _: {"value": library.device_get_model(tag)}),
            ("get_name", "get_string", lambda _: {"value": calls.name}),
            ("get_node_type", "get_int", lambda _: {"value": library.device_get_node_type(tag)}),
            *rows,
        ),
        streams=streams,
        camera=camera,
    )


def switch(calls: Calls, end: str = "", begin: str = "") -> Callable[[int], None]:
    """Return the function that enables a sensor with a period in ms, and disables it with 0.

    Args:
        calls: the functions of the device or the input.
        end: the text after "enable" and "disable" in the names of the two functions, such as "_presence".
        begin: the text before "enable" and "disable", such as "recognition_".
    """

    def enabled(period_ms: int) -> None:
        if period_ms:
            getattr(calls, f"{begin}enable{end}")(period_ms)
        else:
            getattr(calls, f"{begin}disable{end}")()

    return enabled


def facts(calls: Calls, type_name: str, *names: str) -> tuple[Row, ...]:
    """Return services that are named after functions without arguments, and return their values."""
    return tuple((name, type_name, partial(_fact, getattr(calls, name))) for name in names)


def commands(calls: Calls, type_name: str, *names: str) -> tuple[Row, ...]:
    """Return services that pass the request's value to the function of the same name, and always succeed."""
    return tuple((name, type_name, partial(_command, getattr(calls, name))) for name in names)


def lookup_table(calls: DeviceCalls) -> Row:
    """Return the service that returns the lookup table: three numbers for each row."""

    def get_lookup_table(_request: Any) -> dict[str, Any]:
        count = 3 * calls.get_lookup_table_size()
        return {"value": calls.get_lookup_table()[:count] if count else []}

    return "get_lookup_table", "get_float_array", get_lookup_table


def neighbors(calls: DeviceCalls, *roles: str) -> tuple[Row, ...]:
    """Return the services that return the names of other devices of the joint."""
    return tuple(
        (f"get_{role}_name", "get_string", lambda _, role=role: {"value": calls.name_of(role)})
        for role in roles
    )


def elements(array: Any, count: int) -> Iterator[Any]:
    """Yield the elements of an array of structures, or nothing if the array is NULL."""
    for index in range(count if array else 0):
        yield array[index]


def copied(pointer: Any, size: int) -> list[bytes]:
    """Return the `size` bytes at a pointer as a list with one item; the list is empty for NULL."""
    return [ctypes.string_at(pointer, size)] if pointer else []


def _fact(function: Callable[[], Any], _request: Any) -> dict[str, Any]:
    return {"value": function()}


def _command(function: Callable[[Any], Any], request: Any) -> dict[str, Any]:
    function(request.value)
    return _DONE
