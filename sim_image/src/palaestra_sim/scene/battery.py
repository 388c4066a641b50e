"""The battery of a robot; the robot's CPU drains it. A robot with an empty battery does not move.

`Robot.battery` has the energy in joules, the capacity, and the power of a charger; chargers are not
simulated. Motors consume no energy here. In Webots their consumption depends on their torque, which is 0
without dynamics.
Source: WbRobot::energyConsumption, WbMotor::energyConsumption.
"""

from __future__ import annotations

from typing import Final

from palaestra_sim.scene.nodes.scene_node import SceneNode

_CPU_W: Final = 10.0  # the default of Robot.cpuConsumption


class Battery:
    """The battery of the robot at `node`; its energy is the first number of the node's `battery`."""

    def __init__(self, node: SceneNode) -> None:
        self._node = node
        self._start_j = self._energy_j
        consumption = node.numbers("cpuConsumption")
        self._power_w = consumption[0] if consumption else _CPU_W

    @property
    def value(self) -> float:
        """The energy in joules; -1 for a robot without a battery."""
        energy_j = self._energy_j
        return -1.0 if energy_j is None else energy_j

    @property
    def empty(self) -> bool:
        """Whether the robot has a battery without energy."""
        return self._energy_j == 0.0

    def drain(self, duration_s: float) -> None:
        """Subtract the energy that the robot consumes in `duration_s`."""
        energy_j = self._energy_j
        if energy_j is not None:
            self._set(max(0.0, energy_j - self._power_w * duration_s))

    def reset(self) -> None:
        """Return to the energy of the world file."""
        if self._start_j is not None:
            self._set(self._start_j)

    @property
    def _energy_j(self) -> float | None:
        numbers = self._node.numbers("battery")
        return numbers[0] if numbers else None

    def _set(self, energy_j: float) -> None:
        self._node.fields["battery"].items[0] = energy_j
