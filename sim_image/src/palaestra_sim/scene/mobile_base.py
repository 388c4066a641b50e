"""The mobile base: it computes a robot's speed from the commands to the motors of the robot's wheels.

`wheel_kinematics` relates wheel speeds to the robot's motion. In Webots torque and friction limit the
acceleration of a robot. Here three limits replace torque and friction: 10 m/s2 along x, 6 m/s2 along y, and
20 rad/s2 about z. These limits come from the Robotino 3's own controller (Webots,
projects/robots/festo/robotino3/controllers/robotino3/base.c). The same factor slows all three axes, as in
`base_accelerate` of that controller. A motor's own `acceleration` is an additional limit. The three limits do
not apply to a robot without physics. For such a robot, Webots limits the acceleration of each wheel
(`Motor.kinematic`).

Every simulator uses this module, so a robot responds to the same commands in the same way in all simulators.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import sub
from typing import Final

from palaestra_sim.scene.motors import Motor
from palaestra_sim.scene.steering import SteeredDrive
from palaestra_sim.scene.wheel_kinematics import Drive

ACCELERATIONS: Final = (10.0, 6.0, 20.0)  # m/s2, m/s2, rad/s2
_X, _Y, _TURN = ACCELERATIONS


class MobileBase:
    """The wheels of a robot.

    Args:
        wheels: the motors of the wheels.
        drive: the kinematics of these wheels; None if the wheels do not move the robot.

    Attributes:
        drive: the argument `drive`.
        vx, vy, omega: the speed of the robot in m/s and rad/s, in the robot's own axes.
    """

    __slots__ = ("_kinematic", "_step_s", "_wheels", "drive", "omega", "vx", "vy")

    def __init__(self, wheels: Sequence[Motor] = (), drive: Drive | SteeredDrive | None = None) -> None:
        if drive is not None and len(wheels) != len(drive.to_speeds):
            raise ValueError(f"{len(wheels)} motors do not fit a drive of {len(drive.to_speeds)} wheels")
        self.drive = drive
        self._wheels = tuple(wheels) if drive is not None else ()
        self._kinematic = all(wheel.kinematic for wheel in wheels)
        self._step_s = 0.0
        self.halt()

    def has(self, motor: Motor) -> bool:
        """Return whether a motor turns one of the wheels."""
        return motor in self._wheels

    def halt(self) -> None:
        """Stop all motion, including the motion of the motors."""
        self.vx = self.vy = self.omega = 0.0
        for wheel in self._wheels:
            wheel.halt()

    def push(self, vx: float, vy: float, omega: float) -> None:
        """Give the robot a speed in its own axes; its motors continue from this speed."""
        self.vx, self.vy, self.omega = vx, vy, omega
        if self.drive is not None:
            speeds = self.drive.wheel_speeds(vx, vy, omega)
            for wheel, speed in zip(self._wheels, speeds, strict=True):
                wheel.speed_rad_s = speed
                wheel.changed = True

    def turn(self, step_s: float) -> bool:
        """Turn the wheels for one basic step; return whether they move the robot."""
        law = self.drive
        if law is None:
            self.vx = self.vy = self.omega = 0.0
            return False
        changed = step_s != self._step_s
        for wheel in self._wheels:
            changed = changed or wheel.changed
        if changed:
            self._approach(step_s, law)
        for wheel in self._wheels:
            wheel.angle_rad += wheel.speed_rad_s * step_s
        return bool(self.vx or self.vy or self.omega)

    def _approach(self, step_s: float, law: Drive | SteeredDrive) -> None:
        """Change the speeds of the wheels toward those that their motors demand."""
        wheels = self._wheels
        speeds = [wheel.speed_rad_s for wheel in wheels]
        demands = [wheel.demand(step_s) for wheel in wheels]
        vx, vy, omega = law.twist(list(map(sub, demands, speeds)))
        # The number of steps that the slowest axis needs for its change at its largest acceleration.
        steps = max(abs(vx) / (_X * step_s), abs(vy) / (_Y * step_s), abs(omega) / (_TURN * step_s))
        if steps > 1.0 and not self._kinematic:
            demands = [
                speed + (demand - speed) / steps for demand, speed in zip(demands, speeds, strict=True)
            ]
        for wheel, speed in zip(wheels, demands, strict=True):
            wheel.speed_rad_s = speed
            wheel.changed = not wheel.steady
        self.vx, self.vy, self.omega = law.twist(demands)
        self._step_s = step_s


class SteeredBase(MobileBase):
    """The wheels of a robot with steered wheels, whose angles change the drive."""

    __slots__ = ("_steered",)

    def __init__(self, wheels: Sequence[Motor], drive: SteeredDrive) -> None:
        super().__init__(wheels, drive)
        self._steered = drive

    def turn(self, step_s: float) -> bool:
        """Turn the wheels for one basic step; return whether they move the robot."""
        if self._steered.changed():
            for wheel in self._wheels:
                wheel.changed = True
        return super().turn(step_s)
