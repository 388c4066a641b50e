"""The bases of all rows as arrays; `MobileBase` and `MujocoBody` compute the same values for one robot.

The arithmetic operations have the same order as in those classes, so that each row has the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from palaestra_sim.mujoco.batched.trigonometry import cosines, sines, within_half_turn
from palaestra_sim.scene.mobile_base import ACCELERATIONS
from palaestra_sim.scene.motors import MotorSpec
from palaestra_sim.scene.wheel_kinematics import Drive

_X, _Y, _TURN = ACCELERATIONS
_HEADING: Final = 2


class Bases:
    """The wheels and bodies of `count` copies of one robot.

    Args:
        count: the number of rows.
        specs: the motors of the wheels.
        drive: the kinematics of the wheels.

    Attributes:
        angles_rad: the angles of the wheels (rows, wheels).
        x, y, heading_rad: the poses, (rows,) each.
    """

    def __init__(self, count: int, specs: Sequence[MotorSpec], drive: Drive) -> None:
        wheels = len(specs)
        self._drive = drive
        self._starts_rad = np.array([spec.start_rad for spec in specs])
        self._limits = np.array([spec.max_velocity_rad_s for spec in specs])
        self._multipliers = np.array([spec.multiplier for spec in specs])
        self._accelerations = np.array([spec.acceleration_rad_s2 for spec in specs])
        self._limited = self._accelerations >= 0.0
        self._commands, self._speeds = np.zeros((count, wheels)), np.zeros((count, wheels))
        self.angles_rad = np.zeros((count, wheels))
        self.x, self.y, self.heading_rad = np.zeros(count), np.zeros(count), np.zeros(count)
        # Target speeds and their corrections, in the robot's axes, as in `MujocoBody`.
        self._wanted, self._changes = np.zeros((count, 3)), np.zeros((count, 3))
        self._aims, self._lags = np.zeros((count, 3)), np.zeros((count, 3))

    def restart(self, rows: Any, start: tuple[float, float, float]) -> None:
        """Bring rows to rest at a pose, with wheels at their angles in the world and motors at speed 0."""
        for array in (self._commands, self._speeds, self._wanted, self._changes):
            array[rows] = 0.0
        self.angles_rad[rows] = self._starts_rad
        self._aims[rows] = self._lags[rows] = 0.0
        self.x[rows], self.y[rows], self.heading_rad[rows] = start

    def command(self, rows: Any, commands: Any) -> None:
        """Set the motors' velocities in rad/s, clipped to their limits; for NaN, keep the old velocity."""
        clipped = np.maximum(-self._limits, np.minimum(self._limits, commands * self._multipliers))
        self._commands[rows] = np.where(np.isnan(commands), self._commands[rows], clipped)

    def turn(self, rows: Any, step_s: float) -> Any:
        """Turn the wheels for one basic step; return the target speeds of the servos (rows, 3)."""
        speeds = self._speeds[rows]
        demands = self._demands(speeds, self._commands[rows], step_s)
        vx, vy, omega = self._drive.twist(list((demands - speeds).T))
        steps = np.maximum(np.abs(vx) / (_X * step_s), np.abs(vy) / (_Y * step_s))
        steps = np.maximum(steps, np.abs(omega) / (_TURN * step_s))[:, None]
        eased = speeds + (demands - speeds) / np.where(steps > 1.0, steps, 1.0)
        demands = np.where(steps > 1.0, eased, demands)
        self._speeds[rows] = demands
        self.angles_rad[rows] += demands * step_s
        wanted = np.stack(self._drive.twist(list(demands.T)), axis=1)
        self._changes[rows] = wanted - self._wanted[rows]
        self._wanted[rows] = wanted
        self._aims[rows] = aims = wanted + self._lags[rows]
        return aims

    def follow(self, rows: Any, positions: Any, step_s: float) -> None:
        """Copy the poses (rows, 3) that MuJoCo has computed, and the differences to the target speeds."""
        x, y = positions[:, 0], positions[:, 1]
        heading = within_half_turn(positions[:, _HEADING])
        omega = within_half_turn(heading - self.heading_rad[rows]) / step_s
        vx, vy = (x - self.x[rows]) / step_s, (y - self.y[rows]) / step_s
        middle = heading - 0.5 * omega * step_s
        c, s = cosines(middle), sines(middle)
        driven = np.stack((vx * c + vy * s, vy * c - vx * s, omega), axis=1)
        missing = self._aims[rows] - driven
        least = np.minimum(np.abs(missing), np.abs(self._changes[rows]))
        self._lags[rows] = np.copysign(least, missing)
        self.x[rows], self.y[rows], self.heading_rad[rows] = x, y, heading

    def _demands(self, speeds: Any, wanted: Any, step_s: float) -> Any:
        if not self._limited.any():
            return wanted
        change = self._accelerations * step_s
        held = np.maximum(speeds - change, np.minimum(speeds + change, wanted))
        return np.where(self._limited, held, wanted)
