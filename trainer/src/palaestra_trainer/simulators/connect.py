"""From a configuration to simulators with environments, not started yet."""

from __future__ import annotations

from typing import Any

import gymnasium

import palaestra_trainer.environments  # noqa: F401 - importing registers what ships

from palaestra_trainer.configuration import Configuration, SimulatorConfiguration, load
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import RobotinoAbc, Scene
from palaestra_trainer.ros import ensure_node
from palaestra_trainer.simulators.sidecar import Sidecar
from palaestra_trainer.simulators.simulator import Simulator


def connect(configuration: Configuration | None = None) -> list[Simulator]:
    """Return the simulators of a configuration, by default of the one PALAESTRA_CONFIG names, not started.

    Raises:
        ConfigurationError: the configuration cannot be read, or names no known environment.
        MasterLost: no ROS master answers.
        SimulatorDead, SimulatorHung: a sidecar cannot be asked.
    """
    chosen = configuration or load()
    ensure_node(f"trainer_r{chosen.replica}")
    return [_simulator(chosen, entry) for entry in chosen.simulators]


def _simulator(configuration: Configuration, entry: SimulatorConfiguration) -> Simulator:
    environment = configuration.environment

    def make(robot: RobotinoAbc, scene: Scene) -> gymnasium.Env[Any, Any]:
        try:
            return gymnasium.make(
                environment.id,
                disable_env_checker=True,  # it was checked when it was written; this one is stepped
                robot=robot,
                scene=scene,
                reward=environment.reward,
                **environment.options,
            )
        except (gymnasium.error.Error, ImportError) as error:
            raise ConfigurationError(
                f"environment.id: {environment.id} cannot be made ({error}); name one that is registered, "
                "or module:name of one that its module registers"
            ) from error

    return Simulator(entry.name, Sidecar(entry.control, entry.name), make, entry.start_deadline_seconds)
