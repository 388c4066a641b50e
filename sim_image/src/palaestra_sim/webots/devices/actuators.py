"""Devices that a client commands: motors, brakes, lights, pens, speakers, skins, connectors and grippers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.ros_controller.served_robot import ServedDevice
from palaestra_sim.ros_interfaces import Fields, Handler, Row
from palaestra_sim.scene.devices.device_type import DeviceTopic
from palaestra_sim.scene.geometry import axis_angle_to_quaternion, quaternion_to_matrix, to_axis_angle
from palaestra_sim.webots.devices.calls import DeviceCalls, Reading, commands, facts, neighbors, served

_DONE: Final = {"success": 1}


def rotational_motor(calls: DeviceCalls) -> ServedDevice:
    """Return a RotationalMotor, whose effort is a torque in N m."""
    return _motor(calls, "torque")


def linear_motor(calls: DeviceCalls) -> ServedDevice:
    """Return a LinearMotor, whose effort is a force in N."""
    return _motor(calls, "force")


def _motor(calls: DeviceCalls, effort: str) -> ServedDevice:
    feedback = DeviceTopic(
        name=f"{effort}_feedback",
        type_name="webots_ros/Float64Stamped",
        source=Reading(getattr(calls, f"get_{effort}_feedback")),
    )

    def set_control_pid(request: Any) -> Fields:
        calls.set_control_pid(request.controlp, request.controli, request.controld)
        return _DONE

    rows = (
        *commands(calls, "set_float", "set_position", "set_velocity", "set_acceleration"),
        *commands(calls, "set_float", f"set_{effort}", f"set_available_{effort}"),
        ("set_control_pid", "motor_set_control_pid", set_control_pid),
        *facts(calls, "get_float", "get_target_position", "get_min_position", "get_max_position"),
        *facts(calls, "get_float", "get_velocity", "get_max_velocity", "get_acceleration", "get_multiplier"),
        *facts(calls, "get_float", f"get_max_{effort}", f"get_available_{effort}"),
        *facts(calls, "get_int", "get_type"),
        *neighbors(calls, "brake", "position_sensor"),
    )
    return served(calls, topics=(feedback,), rows=rows, sensor=f"{effort}_feedback")


def brake(calls: DeviceCalls) -> ServedDevice:
    """Return a Brake of a joint."""
    rows = (
        *commands(calls, "set_float", "set_damping_constant"),
        *facts(calls, "get_int", "get_type"),
        *neighbors(calls, "motor", "position_sensor"),
    )
    return served(calls, rows=rows)


def led(calls: DeviceCalls) -> ServedDevice:
    """Return an LED."""

    def set_led(request: Any) -> Fields:
        calls.set(request.value)
        return {"success": True}

    rows: tuple[Row, ...] = (
        ("set_led", "set_int", set_led),
        ("get_led", "get_int", lambda _: {"value": calls.get()}),
    )
    return served(calls, rows=rows)


def pen(calls: DeviceCalls) -> ServedDevice:
    """Return a Pen."""

    def set_ink_color(request: Any) -> Fields:
        calls.set_ink_color(request.color, request.density)
        return _DONE

    rows = (
        *commands(calls, "set_bool", "write"),
        ("set_ink_color", "pen_set_ink_color", set_ink_color),
    )
    return served(calls, rows=rows)


def speaker(calls: DeviceCalls) -> ServedDevice:
    """Return a Speaker."""

    def play_sound(request: Any) -> Fields:
        calls.play_sound(
            calls.tag, request.sound, request.volume, request.pitch, request.balance, bool(request.loop)
        )
        return _DONE

    def speak(request: Any) -> Fields:
        calls.speak(request.text, request.volume)
        return _DONE

    rows = (
        ("play_sound", "speaker_play_sound", play_sound),
        *commands(calls, "set_string", "stop"),
        (
            "is_sound_playing",
            "speaker_is_sound_playing",
            lambda request: {"value": calls.is_sound_playing(request.sound)},
        ),
        ("set_engine", "set_string", lambda request: {"success": calls.set_engine(request.value)}),
        ("set_language", "set_string", lambda request: {"success": calls.set_language(request.value)}),
        *facts(calls, "get_string", "get_engine", "get_language"),
        ("speak", "speaker_speak", speak),
        *facts(calls, "get_bool", "is_speaking"),
    )
    return served(calls, rows=rows)


def skin(calls: DeviceCalls) -> ServedDevice:
    """Return a Skin."""
    rows: tuple[Row, ...] = (
        *facts(calls, "get_int", "get_bone_count"),
        (
            "get_bone_name",
            "skin_get_bone_name",
            _of_bone(calls, lambda it: {"name": calls.get_bone_name(it.index)}),
        ),
        ("get_bone_orientation", "skin_get_bone_orientation", _of_bone(calls, _bone_orientation(calls))),
        ("get_bone_position", "skin_get_bone_position", _of_bone(calls, _bone_position(calls))),
        ("set_bone_orientation", "skin_set_bone_orientation", _of_bone(calls, _turn_bone(calls))),
        ("set_bone_position", "skin_set_bone_position", _of_bone(calls, _move_bone(calls))),
    )
    return served(calls, rows=rows)


def _of_bone(calls: DeviceCalls, handler: Handler) -> Handler:
    """Return a handler that refuses a bone that does not exist; Webots' controller would crash instead."""

    def handle(request: Any) -> Any:
        count = calls.get_bone_count()
        if not 0 <= request.index < count:
            raise ServiceFailed(f"{calls.name} has no bone {request.index}; it has {count} bones")
        return handler(request)

    return handle


def _bone_orientation(calls: DeviceCalls) -> Handler:
    def get(request: Any) -> Fields:
        x, y, z, w = axis_angle_to_quaternion(calls.get_bone_orientation(request.index, request.absolute))
        return {"orientation": {"x": x, "y": y, "z": z, "w": w}}

    return get


def _bone_position(calls: DeviceCalls) -> Handler:
    def get(request: Any) -> Fields:
        x, y, z = calls.get_bone_position(request.index, request.absolute)
        return {"position": {"x": x, "y": y, "z": z}}

    return get


def _turn_bone(calls: DeviceCalls) -> Handler:
    def set_orientation(request: Any) -> Fields:
        it = request.orientation
        turn = to_axis_angle(quaternion_to_matrix((it.x, it.y, it.z, it.w)))
        calls.set_bone_orientation(request.index, turn, request.absolute)
        return _DONE

    return set_orientation


def _move_bone(calls: DeviceCalls) -> Handler:
    def set_position(request: Any) -> Fields:
        it = request.position
        calls.set_bone_position(request.index, (it.x, it.y, it.z), request.absolute)
        return _DONE

    return set_position


def connector(calls: DeviceCalls) -> ServedDevice:
    """Return a Connector."""
    rows = (_set_bool("lock", calls.lock, calls.unlock), *facts(calls, "get_bool", "is_locked"))
    return served(calls, topics=(_presence(calls, "Int8Stamped"),), rows=rows, sensor="presence")


def vacuum_gripper(calls: DeviceCalls) -> ServedDevice:
    """Return a VacuumGripper."""
    rows = (_set_bool("turn_on", calls.turn_on, calls.turn_off), *facts(calls, "get_bool", "is_on"))
    return served(calls, topics=(_presence(calls, "BoolStamped"),), rows=rows, sensor="presence")


def _presence(calls: DeviceCalls, type_name: str) -> DeviceTopic:
    return DeviceTopic(
        name="presence", type_name=f"webots_ros/{type_name}", source=Reading(calls.get_presence)
    )


def _set_bool(name: str, on: Callable[[], Any], off: Callable[[], Any]) -> Row:
    """Return the service that calls `on` for true and `off` for false."""

    def set_bool(request: Any) -> Fields:
        (on if request.value else off)()
        return _DONE

    return name, "set_bool", set_bool
