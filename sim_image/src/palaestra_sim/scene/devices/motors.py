"""RotationalMotor and LinearMotor: every setter returns success, even if the motor ignores the value.

The services that set torques and forces fail, unless the physics moves the motor by forces.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from palaestra_sim.ros_interfaces import Handler, Row, UnsimulatedError
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceTopic, DeviceType
from palaestra_sim.scene.motors import Motor, MotorSpec

_ROTATIONAL: Final = 0  # the value that `get_type` returns for a RotationalMotor
_LINEAR: Final = 1
_FIELDS: Final = """
    acceleration SFFloat -1; consumptionFactor SFFloat 10;
    controlPID SFVec3f 10 0 0; maxVelocity SFFloat 10; minPosition SFFloat 0;
    maxPosition SFFloat 0; {} SFFloat 10; multiplier SFFloat 1;
    sound MFString sounds/{}.wav; muscles MFNode"""


def _reader(limit: str) -> Callable[[DevicePart], Motor]:
    """Return the function that reads a motor; the field `limit` has the motor's largest torque or force."""

    def read(part: DevicePart) -> Motor:
        number = part.number
        return Motor(
            MotorSpec(
                name=part.name,
                max_velocity_rad_s=number("maxVelocity", 10.0),
                acceleration_rad_s2=number("acceleration", -1.0),
                min_rad=number("minPosition", 0.0),
                max_rad=number("maxPosition", 0.0),
                max_torque_nm=number(limit, 10.0),
                multiplier=number("multiplier", 1.0) or 1.0,  # Webots uses 1 instead of 0
                gains=_gains(part),
                model=part.text("model"),
                forces=part.forces,
            )
        )

    return read


def _gains(part: DevicePart) -> tuple[float, float, float]:
    p, i, d = part.reading.vector(part.node, "controlPID", (10.0, 0.0, 0.0))
    return p, i, d


def _services(effort: str, type_number: int) -> Callable[[Motor], tuple[Row, ...]]:
    """Return a function that lists the services of a motor; `effort` is "torque" or "force"."""

    def services(motor: Motor) -> tuple[Row, ...]:
        return (
            *_commands(motor, effort),
            *_answers(motor, effort),
            ("get_type", "get_int", lambda _: {"value": type_number}),
        )

    return services


def _commands(motor: Motor, effort: str) -> tuple[Row, ...]:
    return (
        ("set_position", "set_float", _setter(motor.set_position)),
        ("set_velocity", "set_float", _setter(motor.set_velocity)),
        ("set_acceleration", "set_float", _setter(motor.set_acceleration)),
        (
            f"set_{effort}",
            "set_float",
            _setter(motor.set_effort) if motor.forceful else _unable(motor, effort),
        ),
        (
            f"set_available_{effort}",
            "set_float",
            _setter(motor.set_available_torque) if _has_effort(motor) else _switch(motor, effort),
        ),
        ("set_control_pid", "motor_set_control_pid", _gains_setter(motor)),
        *(() if motor.forceful else _no_feedback(effort)),
    )


def _no_feedback(effort: str) -> tuple[Row, ...]:
    """Return the feedback services of a motor whose feedback has no topic."""
    return (
        (f"{effort}_feedback_sensor/enable", "set_int", lambda request: {"success": request.value == 0}),
        (f"{effort}_feedback_sensor/get_sampling_period", "get_int", lambda _: {"value": 0}),
    )


@dataclass(frozen=True, slots=True)
class Feedback:
    """The torque or force of a motor in the last basic step."""

    motor: Motor

    @property
    def value(self) -> float:
        """The torque in N m, or the force in N; positive if it moves the motor forward."""
        return self.motor.feedback_nm


def _topics(effort: str) -> Callable[[Motor], tuple[DeviceTopic, ...]]:
    """Return a function that lists the topics of a motor; `effort` is "torque" or "force"."""

    def topics(motor: Motor) -> tuple[DeviceTopic, ...]:
        if not motor.forceful:
            return ()
        return (
            DeviceTopic(
                name=f"{effort}_feedback", type_name="webots_ros/Float64Stamped", source=Feedback(motor)
            ),
        )

    return topics


def _answers(motor: Motor, effort: str) -> tuple[Row, ...]:
    spec = motor.spec
    return (
        ("get_target_position", "get_float", lambda _: {"value": motor.asked_rad}),
        ("get_min_position", "get_float", lambda _: {"value": spec.min_rad}),
        ("get_max_position", "get_float", lambda _: {"value": spec.max_rad}),
        ("get_velocity", "get_float", lambda _: {"value": motor.asked_velocity_rad_s}),
        ("get_max_velocity", "get_float", lambda _: {"value": spec.max_velocity_rad_s}),
        ("get_acceleration", "get_float", lambda _: {"value": motor.acceleration_rad_s2}),
        ("get_multiplier", "get_float", lambda _: {"value": spec.multiplier}),
        (f"get_max_{effort}", "get_float", lambda _: {"value": spec.max_torque_nm}),
        (f"get_available_{effort}", "get_float", lambda _: {"value": motor.available_torque_nm}),
    )


def _setter(command: Callable[[float], None]) -> Handler:
    done = {"success": True}

    def handle(request: Any) -> dict[str, Any]:
        command(request.value)
        return done

    return handle


def _gains_setter(motor: Motor) -> Handler:
    def handle(request: Any) -> dict[str, Any]:
        motor.set_control_pid(request.controlp, request.controli, request.controld)
        return {"success": 1}

    return handle


def _has_effort(motor: Motor) -> bool:
    """Return whether the torque or force of a motor affects its motion."""
    return motor.forceful or motor.kinematic


def _switch(motor: Motor, effort: str) -> Handler:
    """Return the service of a motor that moves with its full torque, or not at all."""
    done = {"success": True}
    most = motor.spec.max_torque_nm

    def handle(request: Any) -> dict[str, Any]:
        if 0.0 < request.value < most:
            fact = f"{motor.name!r} cannot use a part of its {effort} in this simulator"
            raise UnsimulatedError(f"{fact}; set 0, or the whole {effort} of {most:g}")
        motor.set_available_torque(request.value)
        return done

    return handle


def _unable(motor: Motor, effort: str) -> Handler:
    fact = f"{effort}s are not simulated"
    if motor.spec.forces:
        fact = f"a {effort} does not move a driving wheel or a part without physics"

    def fail(_request: Any) -> dict[str, Any]:
        raise UnsimulatedError(f"{fact}; set a position or velocity")

    return fail


ROTATIONAL_MOTOR: Final = DeviceType(
    node="RotationalMotor",
    name="rotational motor",
    without_effect="consumptionFactor sound muscles",
    fields=_FIELDS.format("maxTorque", "rotational_motor"),
    role="motor",
    read=_reader("maxTorque"),
    services=_services("torque", _ROTATIONAL),
    topics=_topics("torque"),
    sensor="torque_feedback_sensor",
)
LINEAR_MOTOR: Final = DeviceType(
    node="LinearMotor",
    name="linear motor",
    without_effect="consumptionFactor sound muscles",
    fields=_FIELDS.format("maxForce", "linear_motor"),
    role="motor",
    read=_reader("maxForce"),
    services=_services("force", _LINEAR),
    topics=_topics("force"),
    sensor="force_feedback_sensor",
)
