"""The simulated time between two samples of a device."""

from __future__ import annotations

from dataclasses import dataclass

from palaestra_sim.scene.devices.device_type import Carrier


@dataclass(slots=True, eq=False)
class StepTimer:
    """Measures the time of the world between samples of a device on `robot`."""

    robot: Carrier
    _at_s: float = 0.0
    _resets: int = 0

    def elapsed(self) -> tuple[float, bool]:
        """Return the seconds since the last call, and whether the world was reset meanwhile."""
        robot, before_s, resets = self.robot, self._at_s, self._resets
        self._at_s, self._resets = robot.time_s, robot.resets
        if robot.resets != resets:
            return robot.time_s, True
        return robot.time_s - before_s, False
