"""Services of one rotational motor. Every setter answers success, whatever the motor makes of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from palaestra_sim.stub.catalogue import type_number
from palaestra_sim.stub.devices import Devices, PositionSensor
from palaestra_sim.stub.motors import Motor
from palaestra_sim.stub.ros.node import ServiceFailed
from palaestra_sim.stub.seam import Handler, Service, topic_name

Fields = dict[str, Any]
Row = tuple[str, str, Handler]
_ROTATIONAL = 0


def motor_services(motor: Motor, devices: Devices) -> tuple[Service, ...]:
    """Return the services of a motor, with their paths below the robot's name."""
    path = topic_name(motor.spec.name)
    return tuple(
        Service(f"{path}/{name}", f"webots_ros/{type_name}", handler)
        for name, type_name, handler in (*_commands(motor), *_answers(motor, devices))
    )


def _commands(motor: Motor) -> tuple[Row, ...]:
    return (
        ("set_position", "set_float", _setter(motor.set_position)),
        ("set_velocity", "set_float", _setter(motor.set_velocity)),
        ("set_acceleration", "set_float", _setter(motor.set_acceleration)),
        ("set_torque", "set_float", _no_torque),
        ("set_available_torque", "set_float", _setter(motor.set_available_torque)),
        ("set_control_pid", "motor_set_control_pid", lambda _: {"success": 1}),
        ("torque_feedback_sensor/enable", "set_int", lambda _: {"success": False}),
    )


def _answers(motor: Motor, devices: Devices) -> tuple[Row, ...]:
    spec = motor.spec
    sensor = _position_sensor(motor, devices)
    return (
        ("get_model", "get_string", lambda _: {"value": spec.model}),
        ("get_name", "get_string", lambda _: {"value": spec.name}),
        ("get_node_type", "get_int", lambda _: {"value": type_number("RotationalMotor")}),
        ("get_target_position", "get_float", lambda _: {"value": motor.target_rad}),
        ("get_min_position", "get_float", lambda _: {"value": spec.min_rad}),
        ("get_max_position", "get_float", lambda _: {"value": spec.max_rad}),
        ("get_velocity", "get_float", lambda _: {"value": motor.velocity_rad_s}),
        ("get_max_velocity", "get_float", lambda _: {"value": spec.max_velocity_rad_s}),
        ("get_acceleration", "get_float", lambda _: {"value": motor.acceleration_rad_s2}),
        ("get_multiplier", "get_float", lambda _: {"value": spec.multiplier}),
        ("get_max_torque", "get_float", lambda _: {"value": spec.max_torque_nm}),
        ("get_available_torque", "get_float", lambda _: {"value": motor.available_torque_nm}),
        ("get_type", "get_int", lambda _: {"value": _ROTATIONAL}),
        ("get_brake_name", "get_string", lambda _: {"value": ""}),
        ("get_position_sensor_name", "get_string", lambda _: {"value": sensor}),
    )


def _position_sensor(motor: Motor, devices: Devices) -> str:
    """Return the name of the sensor at the same joint, "" if there is none."""
    sensors = (it for it in devices.sensors.values() if isinstance(it, PositionSensor))
    return next((it.name for it in sensors if it.motor is motor), "")


def _setter(command: Callable[[float], None]) -> Handler:
    done: Fields = {"success": True}

    def handle(request: Any) -> Fields:
        command(request.value)
        return done

    return handle


def _no_torque(_request: Any) -> Fields:
    raise ServiceFailed("the stub simulates no torques; set a position or velocity")
