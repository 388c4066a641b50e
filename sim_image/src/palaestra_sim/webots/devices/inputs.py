"""Battery, keyboard and joystick, which every robot has although they are not nodes of the world."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Final

from palaestra_sim.ros_controller.served_robot import ServedDevice
from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.devices.device_type import DeviceTopic
from palaestra_sim.webots.devices.calls import Reading
from palaestra_sim.webots.library import Library

_NO_KEY: Final = -1
_AXES: Final = 6  # as many topics as the simulators of this package have
_POVS: Final = 1
_NUMBER: Final = "webots_ros/Int32Stamped"


def inputs(library: Library) -> tuple[ServedDevice, ...]:
    """Return the battery, the keyboard and the joystick of the robot."""
    return _battery(library), _keyboard(library), _joystick(library)


def _battery(library: Library) -> ServedDevice:
    value = DeviceTopic(
        name="value",
        type_name="webots_ros/Float64Stamped",
        source=Reading(library.robot_battery_sensor_get_value),
    )
    return ServedDevice(
        path="battery_sensor",
        topics=(value,),
        enabled=_switch(library.robot_battery_sensor_enable, library.robot_battery_sensor_disable),
    )


def _keyboard(library: Library) -> ServedDevice:
    # libController returns the pressed keys one by one, and -1 at the end.
    keys = Reading(lambda: list(iter(library.keyboard_get_key, _NO_KEY)))
    return ServedDevice(
        path="keyboard",
        topics=(DeviceTopic(name="key", type_name=_NUMBER, source=keys, many=True),),
        enabled=_switch(library.keyboard_enable, library.keyboard_disable),
    )


def _joystick(library: Library) -> ServedDevice:
    axes, povs = library.joystick_get_number_of_axes, library.joystick_get_number_of_povs
    button = Reading(library.joystick_get_pressed_button)  # -1 without a button; one message for each step
    return ServedDevice(
        path="joystick",
        topics=(
            DeviceTopic(name="pressed_button", type_name=_NUMBER, source=button),
            *(_part(f"axis{i}", axes, library.joystick_get_axis_value, i) for i in range(_AXES)),
            *(_part(f"pov{i}", povs, library.joystick_get_pov_value, i) for i in range(_POVS)),
        ),
        enabled=_switch(library.joystick_enable, library.joystick_disable),
        rows=(
            ("get_model", "get_string", lambda _: {"value": library.joystick_get_model()}),
            ("get_number_of_axes", "get_int", lambda _: {"value": axes()}),
            ("get_number_of_povs", "get_int", lambda _: {"value": povs()}),
            ("is_connected", "get_bool", lambda _: {"value": library.joystick_is_connected()}),
            *_force_feedback(library),
        ),
    )


def _force_feedback(library: Library) -> tuple[Row, ...]:
    types = {
        "set_constant_force": "set_int",
        "set_constant_force_duration": "set_float",
        "set_auto_centering_gain": "set_float",
        "set_resistance_gain": "set_float",
        "set_force_axis": "set_int",
    }
    return tuple(
        (name, type_name, partial(_command, getattr(library, f"joystick_{name}")))
        for name, type_name in types.items()
    )


def _command(function: Callable[[Any], Any], request: Any) -> Fields:
    function(request.value)
    return {"success": True}


def _part(name: str, count: Callable[[], int], read: Callable[[int], int], index: int) -> DeviceTopic:
    """Return the topic of an axis or a point of view; it has no message if the joystick lacks this part."""
    source = Reading(lambda: [read(index)] if index < count() else [])
    return DeviceTopic(name=name, type_name=_NUMBER, source=source, many=True)


def _switch(enable: Callable[[int], Any], disable: Callable[[], Any]) -> Callable[[int], None]:
    def enabled(period_ms: int) -> None:
        if period_ms:
            enable(period_ms)
        else:
            disable()

    return enabled
