"""Actuators as motors of Webots: translate a motor's commands to MuJoCo's `ctrl`.

The control of an actuator sets a position, a velocity or a force, and its motor accepts the matching
commands. If the control sets a velocity, the motor also accepts a target position, and turns to this position
as a motor of Webots does. Until a client commands a motor, the control keeps its initial value: 0, or the
value in the keyframe.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.mjcf.model import HINGE, SLIDE, Model
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.motors import Motor, MotorSpec

JOINTS: Final = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_FIXED: Final = int(mujoco.mjtGain.mjGAIN_FIXED)
_LINEAR: Final = (int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE))
_DIRECT: Final = tuple(
    int(it) for it in (mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT)
)
_INTEGRATED: Final = int(mujoco.mjtDyn.mjDYN_INTEGRATOR)
_SPHERICAL: Final = (int(mujoco.mjtJoint.mjJNT_BALL), int(mujoco.mjtJoint.mjJNT_FREE))
_TURNED: Final = (*JOINTS, int(mujoco.mjtTrn.mjTRN_TENDON), int(mujoco.mjtTrn.mjTRN_SLIDERCRANK))


class Control(Enum):
    """The quantity that the control of an actuator sets."""

    POSITION = "position"
    VELOCITY = "velocity"
    FORCE = "force"


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelActuator:
    """One actuator of a model.

    Attributes:
        control: the quantity that the actuator's control sets.
        scale: the value of the control for a position, velocity or force of 1 at the joint.
        length: returns the position of the actuator's joint or tendon, in rad or m; None if it has neither.
        read: returns the current control.
        write: sets the control to a value.
        force: returns the force or torque at the joint, in N or N m.
    """

    control: Control
    scale: float
    length: Callable[[], float] | None
    read: Callable[[], float]
    write: Callable[[float], None]
    force: Callable[[], float]


class ActuatorMotor(Motor):
    """The motor of an actuator."""

    __slots__ = ("_actuator", "_aim", "_commanded")

    def __init__(self, spec: MotorSpec, actuator: ModelActuator) -> None:
        self._actuator = actuator
        super().__init__(spec)
        self.forceful = True  # MuJoCo moves all bodies by forces

    @property
    def control(self) -> tuple[Control, float]:
        """The quantity that the actuator's control sets, and `ModelActuator.scale`."""
        return self._actuator.control, self._actuator.scale

    def reset(self) -> None:
        """Discard all commands; call this method after the model was reset."""
        super().reset()
        self._commanded = False
        if self._actuator.length is not None:
            self.angle_rad = self.target_rad = self.asked_rad = self._actuator.length()
        if self._actuator.control is Control.POSITION:
            self.target_rad = self.asked_rad = self._actuator.read() / self._actuator.scale
        self._aim: float | None = None  # current target of a position servo

    def put(self, angle_rad: float) -> None:
        """Respond to a client that has set the joint position; a motor with a command holds this position."""
        if self._commanded and self._actuator.control is not Control.FORCE:
            super().put(angle_rad)
        self._aim = None

    def set_position(self, target_rad: float) -> None:
        """Turn to `target_rad`; if it is infinite, turn at the commanded velocity; see `Motor`."""
        self._require_servo()
        super().set_position(target_rad)
        self._commanded = True

    def set_velocity(self, velocity_rad_s: float) -> None:
        """Set the velocity; see `Motor`."""
        self._require_servo()
        super().set_velocity(velocity_rad_s)
        self._commanded = True

    def set_acceleration(self, acceleration_rad_s2: float) -> None:
        """Limit the acceleration of a velocity servo; see `Motor`."""
        if self._actuator.control is not Control.VELOCITY and acceleration_rad_s2 != -1.0:
            raise UnsimulatedError(f"{self._what()}, so MuJoCo cannot limit its acceleration")
        super().set_acceleration(acceleration_rad_s2)

    def set_effort(self, torque_nm: float) -> None:
        """Apply a force in N or a torque in N m from now on; see `Motor`.

        Raises:
            UnsimulatedError: the actuator is a servo.
        """
        if self._actuator.control is not Control.FORCE:
            raise UnsimulatedError(f"{self._what()}; set a position or velocity, or write <motor>")
        super().set_effort(torque_nm)
        self._commanded = self.effort_nm is not None

    def set_available_torque(self, torque_nm: float) -> None:
        """Raise an error, because only the model can limit the force of an actuator.

        Raises:
            UnsimulatedError: always.
        """
        del torque_nm
        raise UnsimulatedError(f"{self._what()}; only forcerange in the model can limit its force")

    def set_control_pid(self, p: float, i: float, d: float) -> None:
        """Set the gains with which a velocity servo turns to a target; see `Motor`.

        Raises:
            UnsimulatedError: the control does not set a velocity, so only the model can set the gains.
        """
        if self._actuator.control is not Control.VELOCITY and (p, i, d) != self.spec.gains:
            raise UnsimulatedError(f"{self._what()}; only kp and kv in the model can set its gains")
        super().set_control_pid(p, i, d)

    def feel(self) -> None:
        """Copy the current position and force from MuJoCo."""
        if self._actuator.length is not None:
            self.angle_rad = self._actuator.length()
        self.feedback_nm = self._actuator.force()

    def command(self, step_s: float) -> None:
        """Set the control for the next basic step, as the last command requires."""
        if self._actuator.length is not None:
            self.angle_rad = self._actuator.length()
        if self._commanded:
            self._actuator.write(self._actuator.scale * self._wanted(step_s))

    def _wanted(self, step_s: float) -> float:
        if self.effort_nm is not None:
            return self.effort_nm
        if self._actuator.control is Control.POSITION:
            self._aim = self._next_aim(self.angle_rad if self._aim is None else self._aim, step_s)
            return self._aim
        if math.isinf(self.target_rad) and math.isinf(self.velocity_rad_s):
            return 0.0
        self.speed_rad_s = self.demand(step_s)
        return self.speed_rad_s

    def _next_aim(self, aim: float, step_s: float) -> float:
        """Return the next target of a position servo; the target moves at the commanded velocity."""
        reach = abs(self.velocity_rad_s) * step_s
        if math.isfinite(self.target_rad):
            return max(aim - reach, min(aim + reach, self.target_rad))
        if math.isfinite(reach):
            aim += math.copysign(reach, self.velocity_rad_s * math.copysign(1.0, self.target_rad))
        low, high = self.spec.min_rad, self.spec.max_rad
        return aim if low == high else max(low, min(high, aim))

    def _require_servo(self) -> None:
        if self._actuator.control is Control.FORCE:
            remedy = "set a force or torque, or write <position> or <velocity>"
            raise UnsimulatedError(f"{self._what()}; {remedy}")

    def _what(self) -> str:
        return f"the actuator of {self.name!r} is controlled by {self._actuator.control.value}"


def control_of(model: Any, index: int) -> tuple[Control, float] | None:
    """Return the quantity that an actuator's control sets, and `ModelActuator.scale`.

    Return None if the actuator is not a motor, such as a muscle, or has several controls.
    """
    if model.actuator_ctrlnum[index] != 1:
        return None
    gain, bias = model.actuator_gainprm[index], model.actuator_biasprm[index]
    dynamics = int(model.actuator_dyntype[index])
    known = (
        int(model.actuator_gaintype[index]) == _FIXED
        and int(model.actuator_biastype[index]) in _LINEAR
        and dynamics in (*_DIRECT, _INTEGRATED)
    )
    integrated = dynamics == _INTEGRATED
    gear = gear_of(model, index)
    if not known or gain[0] == 0.0 or gear == 0.0:
        return None
    if bias[1] != 0.0:
        scale = gear * -float(bias[1] / gain[0])
        return (Control.VELOCITY if integrated else Control.POSITION), scale
    if integrated:
        return None
    if bias[2] != 0.0 and bias[2] == -gain[0]:
        return Control.VELOCITY, gear
    return Control.FORCE, 1.0 / (float(gain[0]) * gear)


def control_address(model: Any, index: int) -> int:
    """Return the place of an actuator's first control in `ctrl`.

    Actuators before it may have several controls each.
    """
    return int(model.actuator_ctrladr[index])


def kind_of(model: Any, index: int) -> str:
    """Return a word for the quantity that an actuator's control sets, such as "velocity"."""
    control = control_of(model, index)
    return "actuator" if control is None else control[0].name.lower()


def gear_of(model: Any, index: int) -> float:
    """Return the force at the joint for an actuator force of 1.

    For an actuator on a site, a ball or a free joint, this is the force in the direction of the gear.
    """
    gear: list[float] = model.actuator_gear[model.actuator_outadr[index]].tolist()
    transmission, target = int(model.actuator_trntype[index]), int(model.actuator_trnid[index][0])
    spherical = transmission in JOINTS and model.jnt_type[target] in _SPHERICAL
    if spherical or transmission == mujoco.mjtTrn.mjTRN_SITE:
        return math.hypot(*gear)
    return gear[0] if transmission in _TURNED else 0.0


def length_of(model: Model, index: int) -> Callable[[], float] | None:
    """Return a function that reads the position of an actuator's joint or tendon; None if it has neither."""
    joint = joint_of(model.model, index)
    if joint is not None:
        positions = model.positions(joint)
        return lambda: float(positions[0])
    if model.model.actuator_trntype[index] not in _TURNED:
        return None
    gear, lengths = gear_of(model.model, index), model.data.actuator_length
    output = int(model.model.actuator_outadr[index])
    return lambda: float(lengths[output]) / gear


def force_of(model: Model, index: int) -> Callable[[], float]:
    """Return a function that reads the force of an actuator at its joint, in N or N m."""
    gear, forces = gear_of(model.model, index), model.data.actuator_force
    output = int(model.model.actuator_outadr[index])
    return lambda: float(forces[output]) * gear


def joint_of(model: Any, index: int) -> int | None:
    """Return the number of the hinge or slider that an actuator moves; None if it moves another object."""
    if model.actuator_trntype[index] not in JOINTS:
        return None
    joint = int(model.actuator_trnid[index][0])
    return joint if model.jnt_type[joint] in {HINGE, SLIDE} else None


def spec_of(model: Any, index: int, name: str, control: Control, scale: float) -> MotorSpec:
    """Return the specification of a motor, with the limits that the model sets for the actuator."""
    low, high = 0.0, 0.0
    limit = math.inf
    address = control_address(model, index)
    if model.actuator_ctrllimited[address]:
        ends = sorted(float(it) / scale for it in model.actuator_ctrlrange[address])
        if control is Control.POSITION:
            low, high = ends
        else:
            limit = max(map(abs, ends))
    force = limit if control is Control.FORCE else math.inf
    if model.actuator_forcelimited[index]:
        strongest = float(max(map(abs, model.actuator_forcerange[index])))
        force = min(force, strongest * abs(gear_of(model, index)))
    return MotorSpec(
        name=name,
        max_velocity_rad_s=limit if control is Control.VELOCITY else math.inf,
        min_rad=low,
        max_rad=high,
        max_torque_nm=force,
    )
