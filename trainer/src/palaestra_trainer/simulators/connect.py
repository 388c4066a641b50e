"""From a configuration to simulators with environments, not started yet.

`connect` finds them behind the sidecars of a pod, `connect_here` starts sidecars of this program's own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium

import palaestra_trainer.environments  # noqa: F401 - importing registers what ships
from palaestra_trainer.configuration import Configuration, SimulatorConfiguration, load
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import RobotinoAbc, Scene
from palaestra_trainer.ros import ensure_node
from palaestra_trainer.simulators.process import ProcessLauncher
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
    return [_simulator(chosen, entry, Sidecar(entry.control, entry.name)) for entry in chosen.simulators]


def connect_here(configuration: Configuration) -> list[Simulator]:
    """Return the same simulators as processes of this program, without a pod: not started either.

    Raises:
        ConfigurationError: a world is not on this machine, or the environment is not known.
    """
    for entry in configuration.simulators:
        if not Path(entry.world).exists():
            raise ConfigurationError(
                f"{entry.world}: the world of {entry.name} is not on this machine; "
                "copy the whole run directory, its worlds too"
            )
    return [
        _simulator(configuration, entry, ProcessLauncher(entry.world)) for entry in configuration.simulators
    ]


def _simulator(configuration: Configuration, entry: SimulatorConfiguration, sidecar: Sidecar) -> Simulator:
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

    return Simulator(entry.name, sidecar, make, entry.start_deadline_seconds)
