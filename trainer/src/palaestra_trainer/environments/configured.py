"""The simulators that PALAESTRA_CONFIG names, handed out one for each environment that asks."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Protocol

from palaestra_trainer.configuration import Configuration, load
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import RobotinoAbc, Scene


class Startable(Protocol):
    """A simulator, as far as an environment has to know one."""

    @property
    def robot(self) -> RobotinoAbc:
        """What is driven in it."""
        ...

    @property
    def scene(self) -> Scene:
        """Where its episodes are arranged."""
        ...

    def start(self) -> None:
        """Start it; `SimulatorFault` if it doesn't come up."""
        ...


def next_simulator() -> tuple[RobotinoAbc, Scene]:
    """Return robot and scene of the next configured simulator, started.

    Raises:
        ConfigurationError: there is no configuration, or all its simulators are taken.
        SimulatorFault: the simulator does not start.
    """
    return take(configured_simulators())


def take(simulators: Iterator[Startable]) -> tuple[RobotinoAbc, Scene]:
    """Return robot and scene of the next of these simulators, started.

    Raises:
        ConfigurationError: none is left.
        SimulatorFault: it does not start.
    """
    simulator = next(simulators, None)
    if simulator is None:
        raise ConfigurationError(
            "PALAESTRA_CONFIG: each of its simulators has an environment; add some, or make fewer"
        )
    simulator.start()
    return simulator.robot, simulator.scene


@cache
def configured_simulators() -> Iterator[Startable]:
    """Return what is left of the simulators in PALAESTRA_CONFIG, the same iterator to everyone.

    Those that collect come first, so that whoever trains before evaluating gets each in its role.
    """
    # Only here do environments meet ROS, and only when nobody gave them a robot.
    from palaestra_trainer.simulators.connect import connect  # noqa: PLC0415

    return iter(connect(collecting_first(load())))


def collecting_first(configuration: Configuration) -> Configuration:
    """Return the same configuration with its simulators by role, in the file's order within each."""
    ordered = configuration.with_role("Collect") + configuration.with_role("Evaluate")
    return configuration.model_copy(update={"simulators": ordered})
