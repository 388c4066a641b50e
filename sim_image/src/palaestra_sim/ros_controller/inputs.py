"""Battery, keyboard and joystick: the controller of every robot has these devices, although no node has them.

In a pod nobody can press keys, so clients press them through services below `palaestra/`. Webots does not
have these services. These services do not depend on the backend, so they work with every simulator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

from palaestra_sim.ros_controller.served_robot import ServedDevice
from palaestra_sim.ros_interfaces import FORCE_FEEDBACK, Fields, Handler, Row
from palaestra_sim.scene.devices.device_type import DeviceTopic
from palaestra_sim.scene.robot import Robot

_MOST_KEYS: Final = 7  # Webots reports at most this many keys at once
_GREATEST_KEY: Final = 2**31 - 1  # the greatest number in the message of a key
_AXES: Final = 6  # the simulated gamepad has two sticks with two axes each, and two triggers
_POVS: Final = 1
_BYTE: Final = (-128, 127)
_NO_BUTTON: Final = -1


def inputs(robot: Robot) -> tuple[ServedDevice, ...]:
    """Return the battery, the keyboard and the joystick of a robot."""
    battery = DeviceTopic(name="value", type_name="webots_ros/Float64Stamped", source=robot.battery)
    return ServedDevice(path="battery_sensor", topics=(battery,)), _keyboard(), _joystick()


@dataclass(slots=True, eq=False)
class _Pressed:
    """The keys or buttons that are pressed, in the order in which they were pressed."""

    most: int
    greatest: int
    value: list[int] = field(default_factory=list)

    def press(self, key: int) -> bool:
        """Press a key; return False if no key has this number, or if too many keys are pressed already."""
        if key in self.value:
            return True
        if not 0 <= key <= self.greatest or len(self.value) >= self.most:
            return False
        self.value.append(key)
        return True

    def release(self, key: int) -> bool:
        """Release a key, or all keys if `key` is -1; return False if the key is not pressed."""
        if key == -1:
            self.value.clear()
            return True
        if key not in self.value:
            return False
        self.value.remove(key)
        return True

    def rows(self) -> tuple[Row, ...]:
        """Return the services that press and release keys or buttons."""
        return (
            ("press", "set_int", lambda request: {"success": self.press(request.value)}),
            ("release", "set_int", lambda request: {"success": self.release(request.value)}),
        )


def _keyboard() -> ServedDevice:
    keys = _Pressed(_MOST_KEYS, _GREATEST_KEY)
    key = DeviceTopic(name="key", type_name="webots_ros/Int32Stamped", source=keys, many=True)
    return ServedDevice(path="keyboard", topics=(key,), own_rows=keys.rows())


@dataclass(slots=True, eq=False)
class _Joystick:
    """A gamepad; it is connected by the first successful call of a service that moves it."""

    buttons: _Pressed = field(default_factory=lambda: _Pressed(_BYTE[1], _BYTE[1]))
    axes: list[int] = field(default_factory=lambda: [0] * _AXES)
    povs: list[int] = field(default_factory=lambda: [0] * _POVS)
    connected: bool = False

    def count(self, parts: Sequence[int]) -> int:
        """Return the number of axes or points of view; -1 before the gamepad is connected, as in Webots."""
        return len(parts) if self.connected else -1

    def turn(self, parts: list[int], values: Sequence[float]) -> bool:
        """Set the first axes or points of view to `values`; return False if there are too many values.

        Also return False if a value is out of range.
        """
        low, high = _BYTE
        if len(values) > len(parts) or not all(low <= value <= high for value in values):
            return False
        parts[: len(values)] = [int(value) for value in values]
        return True


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """One axis or point of view; its value is a list of one number, or empty if no gamepad is connected."""

    joystick: _Joystick
    parts: list[int]
    index: int

    @property
    def value(self) -> list[int]:
        return [self.parts[self.index]] if self.joystick.connected else []


@dataclass(frozen=True, slots=True, eq=False)
class _FirstButton:
    """The button that was pressed first, or -1; as in Webots, a step has one message for all buttons."""

    buttons: _Pressed

    @property
    def value(self) -> int:
        return self.buttons.value[0] if self.buttons.value else _NO_BUTTON


def _joystick() -> ServedDevice:
    joystick = _Joystick()
    topic = partial(DeviceTopic, type_name="webots_ros/Int32Stamped")
    return ServedDevice(
        path="joystick",
        topics=(
            topic(name="pressed_button", source=_FirstButton(joystick.buttons)),
            *(
                topic(name=f"axis{i}", source=_Part(joystick, joystick.axes, i), many=True)
                for i in range(_AXES)
            ),
            *(
                topic(name=f"pov{i}", source=_Part(joystick, joystick.povs, i), many=True)
                for i in range(_POVS)
            ),
        ),
        rows=(*_joystick_answers(joystick), *_force_feedback()),
        own_rows=tuple(_connecting(joystick, row) for row in _joystick_moves(joystick)),
    )


def _joystick_answers(joystick: _Joystick) -> tuple[Row, ...]:
    return (
        ("get_model", "get_string", lambda _: {"value": "palaestra" if joystick.connected else ""}),
        ("get_number_of_axes", "get_int", lambda _: {"value": joystick.count(joystick.axes)}),
        ("get_number_of_povs", "get_int", lambda _: {"value": joystick.count(joystick.povs)}),
        ("is_connected", "get_bool", lambda _: {"value": joystick.connected}),
    )


def _force_feedback() -> tuple[Row, ...]:
    """Return the services for force feedback, which only return success, as in Webots' controller."""
    return tuple((name, type_name, lambda _: {"success": True}) for name, type_name in FORCE_FEEDBACK.items())


def _joystick_moves(joystick: _Joystick) -> tuple[Row, ...]:
    def turner(parts: list[int]) -> Handler:
        return lambda request: {"success": joystick.turn(parts, request.values)}

    return (
        *joystick.buttons.rows(),
        ("set_axes", "set_float_array", turner(joystick.axes)),
        ("set_povs", "set_float_array", turner(joystick.povs)),
    )


def _connecting(joystick: _Joystick, row: Row) -> Row:
    """Return the service `row`, changed so that a successful call also connects the joystick."""
    name, type_name, handler = row

    def handle(request: Any) -> Fields:
        answer: Fields = handler(request)
        joystick.connected = joystick.connected or bool(answer["success"])
        return answer

    return name, type_name, handle
