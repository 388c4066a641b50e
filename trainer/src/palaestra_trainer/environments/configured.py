"""The simulators that PALAESTRA_CONFIG names, handed out one for each environment that asks."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import RobotinoAbc, Scene

if TYPE_CHECKING:
    from palaestra_trainer.simulators.simulator import Simulator


def next_simulator() -> tuple[RobotinoAbc, Scene]:
    """Return robot and scene of the next configured simulator, started.

    Raises:
        ConfigurationError: there is no configuration, or all its simulators are taken.
        SimulatorFault: the simulator does not start.
    """
    simulator = next(configured_simulators(), None)
    if simulator is None:
        raise ConfigurationError(
            "every simulator in PALAESTRA_CONFIG has its environment; add some, or make fewer"
        )
    simulator.start()
    return simulator.robot, simulator.scene


@cache
def configured_simulators() -> Iterator[Simulator]:
    """Return what is left of the simulators in PALAESTRA_CONFIG, the same iterator to everyone."""
    # Only here do environments meet ROS, and only when nobody gave them a robot.
    from palaestra_trainer.simulators.connect import connect  # noqa: PLC0415

    return iter(connect())
