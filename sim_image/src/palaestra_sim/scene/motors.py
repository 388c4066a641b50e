"""Motors, and the positions of their shafts: angles of rotational motors, lengths of linear motors.

A motor has the commands of Webots: a target position and a velocity. With an infinite target, the motor turns
at that velocity. With a finite target, it turns to the target, at most at that velocity. An invalid command
is ignored without an error, because the ROS interface always returns success.

If the end of a joint has physics, a PID controller computes the speed. Without physics, Webots moves the
joint without this controller (`Motor.kinematic`). Source: Webots reference, Motor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

_REACHED: Final = 1e-6  # a joint without physics stops this close to its target, in rad or m, as in Webots


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorSpec:
    """A motor as the world describes it; angles are in rad, velocities in rad/s, torques in N m.

    The units of a linear motor are m, m/s and N. An `acceleration_rad_s2` of -1 means no limit. Equal
    `min_rad` and `max_rad` mean that commands have no limits. The shaft never passes the `stops`; equal
    `stops` mean that the joint has no stops. `start_rad` is the position in the world file. `gains` are P, I
    and D of the motor's controller. `multiplier` scales the positions, velocities and torques that a client
    sets. `forces` is True if the physics has forces.
    """

    name: str
    max_velocity_rad_s: float = 10.0
    acceleration_rad_s2: float = -1.0
    min_rad: float = 0.0
    max_rad: float = 0.0
    max_torque_nm: float = 10.0
    multiplier: float = 1.0
    gains: tuple[float, float, float] = (10.0, 0.0, 0.0)
    start_rad: float = 0.0
    stops: tuple[float, float] = (0.0, 0.0)
    model: str = ""
    forces: bool = False


class Motor:
    """One motor: its commands, and the speed of its shaft.

    The names are for a rotational motor; the angles of a linear motor are lengths in meters.

    Attributes:
        speed_rad_s: the speed of the shaft.
        angle_rad: the angle of the shaft, since the start or the last reset.
        asked_rad, asked_velocity_rad_s: the commands as a client reads them back, before the multiplier.
        gains: P, I and D of the motor's controller.
        kinematic: whether the joint of the motor has no physics. Then, as in Webots, the available torque
            limits the acceleration, and the motor keeps the commanded velocity up to the target.
        changed: whether a command came since the physics last read the motor; the physics clears this flag.
        damping: the damping of the joint, in N m s/rad, set by the joint's brake; 0 without a brake.
        forceful: whether the physics moves the motor's joint by forces.
        effort_nm: the torque that a client set instead of a position; None without such a command.
        feedback_nm: the torque that the motor applied in the last basic step.
    """

    __slots__ = (
        "_integral",
        "_last_error",
        "_rate",
        "acceleration_rad_s2",
        "angle_rad",
        "asked_rad",
        "asked_velocity_rad_s",
        "available_torque_nm",
        "changed",
        "damping",
        "effort_nm",
        "feedback_nm",
        "forceful",
        "gains",
        "kinematic",
        "spec",
        "speed_rad_s",
        "target_rad",
        "velocity_rad_s",
    )

    def __init__(self, spec: MotorSpec) -> None:
        self.spec = spec
        self.forceful = False
        self.kinematic = False
        self.reset()

    @property
    def name(self) -> str:
        """The name of the motor in the world file."""
        return self.spec.name

    @property
    def model(self) -> str:
        """The field `model` of the motor's node."""
        return self.spec.model

    def join(self, start_rad: float, stops: tuple[float, float]) -> None:
        """Set the joint of the motor: its position in the world file, and the stops that it never passes."""
        self.spec = replace(self.spec, start_rad=start_rad, stops=stops)
        self.reset()

    def reset(self) -> None:
        """Return to the initial state: position control to the start position, at the largest velocity."""
        self.target_rad = self.asked_rad = self.spec.start_rad
        self.velocity_rad_s = self.asked_velocity_rad_s = self.spec.max_velocity_rad_s
        self.acceleration_rad_s2 = self.spec.acceleration_rad_s2
        self.available_torque_nm = self.spec.max_torque_nm
        self.damping = 0.0
        self.effort_nm: float | None = None
        self.feedback_nm = 0.0
        self.set_control_pid(*self.spec.gains)
        self.halt()
        self.angle_rad = self.spec.start_rad
        self.changed = True

    def put(self, angle_rad: float) -> None:
        """Set the shaft to an angle, limited by the stops; this angle becomes the target."""
        low, high = self.spec.stops
        self.angle_rad = angle_rad if low == high else max(low, min(high, angle_rad))
        self.target_rad = self.asked_rad = self.angle_rad
        self.halt()

    def halt(self) -> None:
        """Stop the shaft; the motor accelerates again from speed 0."""
        self.speed_rad_s = 0.0
        # A kinematic motor accelerates this speed toward its commanded velocity. With a finite target the
        # speed is never negative, and the side of the target gives the direction.
        self._rate = 0.0
        self.changed = True

    def set_position(self, target_rad: float) -> None:
        """Turn to `target_rad`; if it is infinite, turn at the commanded velocity. NaN is ignored."""
        if math.isnan(target_rad):
            return
        self.asked_rad = target_rad
        if math.isfinite(target_rad):
            target_rad *= self.spec.multiplier
        low, high = self.spec.min_rad, self.spec.max_rad
        if low != high and math.isfinite(target_rad):
            target_rad = max(low, min(high, target_rad))
        self.target_rad = target_rad
        self.effort_nm = None
        self.changed = True

    def set_velocity(self, velocity_rad_s: float) -> None:
        """Set the velocity, times the multiplier, clamped to the motor's limit.

        NaN is ignored, and so is a negative velocity while the target is finite.
        """
        if math.isnan(velocity_rad_s):
            return
        if velocity_rad_s < 0.0 and math.isfinite(self.target_rad):
            return
        limit, multiplier = self.spec.max_velocity_rad_s, self.spec.multiplier
        scaled = velocity_rad_s * multiplier
        self.velocity_rad_s = max(-limit, min(limit, scaled))
        within = self.velocity_rad_s == scaled
        self.asked_velocity_rad_s = velocity_rad_s if within else self.velocity_rad_s / multiplier
        self.changed = True

    def set_acceleration(self, acceleration_rad_s2: float) -> None:
        """Limit the acceleration; -1 means no limit. NaN and other negative values are ignored."""
        if acceleration_rad_s2 >= 0.0 or acceleration_rad_s2 == -1.0:
            self.acceleration_rad_s2 = acceleration_rad_s2
            self.changed = True

    def set_available_torque(self, torque_nm: float) -> None:
        """Set the maximum torque, clamped to the motor's limit. NaN and negative values are ignored."""
        if torque_nm >= 0.0:
            self.available_torque_nm = min(torque_nm, self.spec.max_torque_nm)
            self.changed = True

    def set_control_pid(self, p: float, i: float, d: float) -> None:
        """Set P, I and D of the controller, and reset it. If one value is invalid, all three are ignored."""
        if (p > 0.0 and i >= 0.0 and d >= 0.0) or (p, i, d) == self.spec.gains:
            self.gains = p, i, d
            self._integral = self._last_error = 0.0
            self.changed = True

    def set_effort(self, torque_nm: float) -> None:
        """Apply a torque, times the multiplier, until the next position command. NaN is ignored.

        The torque is clamped to the available torque. The command has an effect only if the motor is
        `forceful`.
        """
        if math.isnan(torque_nm):
            return
        limit = abs(self.available_torque_nm)
        self.effort_nm = max(-limit, min(limit, torque_nm * self.spec.multiplier))
        self.changed = True

    def set_damping(self, constant: float) -> None:
        """Set the damping of the joint. NaN and negative values are ignored."""
        if constant >= 0.0:
            self.damping = constant
            self.changed = True

    def demand(self, step_s: float) -> float:
        """Return the speed in rad/s that the motor demands in the next step; call it once for each step."""
        if self.kinematic:
            return self._kinematic_speed(step_s)
        if not self.available_torque_nm:
            return 0.0
        wanted = self.velocity_rad_s if math.isinf(self.target_rad) else self._toward_target(step_s)
        if self.damping:
            reachable = abs(self.available_torque_nm) / self.damping
            wanted = max(-reachable, min(reachable, wanted))
        if self.acceleration_rad_s2 < 0.0:
            return wanted
        change = self.acceleration_rad_s2 * step_s
        return max(self.speed_rad_s - change, min(self.speed_rad_s + change, wanted))

    def _toward_target(self, step_s: float) -> float:
        """Return the speed that the PID controller demands, at most the commanded velocity."""
        p, i, d = self.gains
        error = self.target_rad - self.angle_rad
        wanted = p * error
        if i or d:
            self._integral += error * step_s
            wanted += i * self._integral + d * (error - self._last_error) / step_s
            self._last_error = error
        limit = abs(self.velocity_rad_s)
        return max(-limit, min(limit, wanted))

    def _kinematic_speed(self, step_s: float) -> float:
        """Return the speed in the next step for a joint without physics; the motion ends at the target."""
        gap = self.target_rad - self.angle_rad
        endless = math.isinf(gap)
        if abs(gap) < _REACHED or (endless and self._at_limit()):
            self._rate = 0.0
            return 0.0
        acceleration = self.acceleration_rad_s2
        if acceleration < 0.0 or acceleration > self.available_torque_nm:
            acceleration = self.available_torque_nm
        wanted = self.velocity_rad_s if endless else abs(self.velocity_rad_s)
        change = acceleration * step_s
        self._rate = max(self._rate - change, min(self._rate + change, wanted))
        if endless:
            return math.copysign(1.0, gap) * self._rate
        return math.copysign(min(abs(gap) / step_s, self._rate), gap)

    def _at_limit(self) -> bool:
        """Return whether a position limit stops a kinematic motor that has no finite target."""
        low, high, velocity = self.spec.min_rad, self.spec.max_rad, self.velocity_rad_s
        if low == high:
            return False
        return (self.angle_rad >= high and velocity >= 0.0) or (self.angle_rad <= low and velocity <= 0.0)

    def advance(self, step_s: float) -> None:
        """Turn the shaft for `step_s` seconds, at most to a stop of its joint."""
        self.speed_rad_s = self.demand(step_s)
        self.angle_rad += self.speed_rad_s * step_s
        low, high = self.spec.stops
        if low != high and not low <= self.angle_rad <= high:
            self.angle_rad = max(low, min(high, self.angle_rad))
            self.speed_rad_s = 0.0

    @property
    def steady(self) -> bool:
        """Return whether the shaft keeps its current speed until the next command."""
        endless = math.isinf(self.target_rad) and self.speed_rad_s == self.velocity_rad_s
        return endless and not (self.kinematic and self.spec.min_rad != self.spec.max_rad)
