"""RotationalMotor: every setter answers success, even if the motor ignores the value."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from palaestra_sim.stub.physics.motors import Motor, MotorSpec
from palaestra_sim.stub.scene.devices.kind import Kind, Part
from palaestra_sim.stub.seam import Handler, Row, UnsimulatedError

_ROTATIONAL: Final = 0


def _read(part: Part) -> Motor:
    number = part.number
    return Motor(
        MotorSpec(
            name=part.name,
            max_velocity_rad_s=number("maxVelocity", 10.0),
            acceleration_rad_s2=number("acceleration", -1.0),
            min_rad=number("minPosition", 0.0),
            max_rad=number("maxPosition", 0.0),
            max_torque_nm=number("maxTorque", 10.0),
            multiplier=number("multiplier", 1.0),
            model=part.text("model"),
        )
    )


def _services(motor: Motor) -> tuple[Row, ...]:
    return (*_commands(motor), *_answers(motor))


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


def _answers(motor: Motor) -> tuple[Row, ...]:
    spec = motor.spec
    return (
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
        ("get_position_sensor_name", "get_string", lambda _: {"value": motor.position_sensor}),
    )


def _setter(command: Callable[[float], None]) -> Handler:
    done = {"success": True}

    def handle(request: Any) -> dict[str, Any]:
        command(request.value)
        return done

    return handle


def _no_torque(_request: Any) -> dict[str, Any]:
    raise UnsimulatedError("the stub simulates no torques; set a position or velocity")


ROTATIONAL_MOTOR: Final = Kind(
    node="RotationalMotor",
    name="rotational motor",
    fields="""acceleration SFFloat -1; consumptionFactor SFFloat 10;
        controlPID SFVec3f 10 0 0; maxVelocity SFFloat 10; minPosition SFFloat 0;
        maxPosition SFFloat 0; maxTorque SFFloat 10; multiplier SFFloat 1;
        sound MFString sounds/rotational_motor.wav; muscles MFNode""",
    on_joint=True,
    read=_read,
    services=_services,
)
