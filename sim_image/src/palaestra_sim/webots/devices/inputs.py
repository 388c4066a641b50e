"""Battery, keyboard and joystick, which every robot has although they are not nodes of the world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from palaestra_sim.ros_controller.served_robot import ServedDevice
from palaestra_sim.ros_interfaces import FORCE_FEEDBACK
from palaestra_sim.scene.devices.device_type import DeviceTopic
from palaestra_sim.webots.devices.calls import InputCalls, Reading, commands, facts, switch
from palaestra_sim.webots.library import Library

_NO_KEY: Final = -1
_AXES: Final = 6  # the number of topics of the joystick in this package's own simulators
_POVS: Final = 1
_NUMBER: Final = "webots_ros/Int32Stamped"


def inputs(library: Library) -> tuple[ServedDevice, ...]:
    """Return the battery, the keyboard and the joystick of the robot."""
    return _battery(library), _keyboard(library), _joystick(library)


def _battery(library: Library) -> ServedDevice:
    battery = InputCalls(library, "robot_battery_sensor")
    value = DeviceTopic(
        name="value", type_name="webots_ros/Float64Stamped", source=Reading(battery.get_value)
    )
    return ServedDevice(path="battery_sensor", topics=(value,), enabled=switch(battery))


def _keyboard(library: Library) -> ServedDevice:
    keyboard = InputCalls(library, "keyboard")
    # libController returns the pressed keys one by one, and -1 at the end.
    keys = Reading(lambda: list(iter(keyboard.get_key, _NO_KEY)))
    return ServedDevice(
        path="keyboard",
        topics=(DeviceTopic(name="key", type_name=_NUMBER, source=keys, many=True),),
        enabled=switch(keyboard),
    )


def _joystick(library: Library) -> ServedDevice:
    joystick = InputCalls(library, "joystick")
    axes, povs = joystick.get_number_of_axes, joystick.get_number_of_povs
    button = Reading(joystick.get_pressed_button)  # -1 if no button is pressed; one message for each step
    return ServedDevice(
        path="joystick",
        topics=(
            DeviceTopic(name="pressed_button", type_name=_NUMBER, source=button),
            *(_part(f"axis{i}", axes, joystick.get_axis_value, i) for i in range(_AXES)),
            *(_part(f"pov{i}", povs, joystick.get_pov_value, i) for i in range(_POVS)),
        ),
        enabled=switch(joystick),
        rows=(
            *facts(joystick, "get_string", "get_model"),
            *facts(joystick, "get_int", "get_number_of_axes", "get_number_of_povs"),
            *facts(joystick, "get_bool", "is_connected"),
            *(
                row
                for name, type_name in FORCE_FEEDBACK.items()
                for row in commands(joystick, type_name, name)
            ),
        ),
    )


def _part(name: str, count: Callable[[], int], read: Callable[[int], int], index: int) -> DeviceTopic:
    """Return the topic of an axis or a point of view; it has no message if the joystick lacks this part."""
    source = Reading(lambda: [read(index)] if index < count() else [])
    return DeviceTopic(name=name, type_name=_NUMBER, source=source, many=True)
