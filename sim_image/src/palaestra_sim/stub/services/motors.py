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
_ROTATIONAL = 0


def motor_services(motor: Motor, devices: Devices) -> tuple[Service, ...]:
    """Return the services of a motor, with their paths below the robot's name."""
    spec = motor.spec
    sensor = next(
        (it.name for it in devices.sensors.values() if isinstance(it, PositionSensor) and it.motor is motor),
        "",
    )
    rows: tuple[tuple[str, str, Handler], ...] = (
        ("get_model", "get_string", lambda _: {"value": spec.model}),
        ("get_name", "get_string", lambda _: {"value": spec.name}),
        ("get_node_type", "get_int", lambda _: {"value": type_number("RotationalMotor")}),
        ("set_position", "set_float", _setter(motor.set_position)),
        ("set_velocity", "set_float", _setter(motor.set_velocity)),
        ("set_acceleration", "set_float", _setter(motor.set_acceleration)),
        ("set_torque", "set_float", _no_torque),
        ("set_available_torque", "set_float", _setter(motor.set_available_torque)),
        ("set_control_pid", "motor_set_control_pid", lambda _: {"success": 1}),
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
        ("torque_feedback_sensor/enable", "set_int", lambda _: {"success": False}),
    )
    path = topic_name(spec.name)
    return tuple(Service(f"{path}/{name}", f"webots_ros/{kind}", do) for name, kind, do in rows)


def _setter(command: Callable[[float], None]) -> Handler:
    done: Fields = {"success": True}

    def handle(request: Any) -> Fields:
        command(request.value)
        return done

    return handle


def _no_torque(_request: Any) -> Fields:
    raise ServiceFailed("the stub simulates no torques; set a position or velocity")
