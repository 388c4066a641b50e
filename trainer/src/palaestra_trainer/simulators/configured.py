"""The simulators in PALAESTRA_CONFIG, one for each environment that asks."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

from palaestra_protocol.pod.terms import Role
from palaestra_trainer.configuration import CONFIG_VARIABLE, Configuration, load
from palaestra_trainer.robots.base import RobotinoAbc, Scene
from palaestra_trainer.simulators.allocation import allocate
from palaestra_trainer.simulators.connect import Arena, connect


@dataclass(frozen=True, slots=True, kw_only=True)
class Configured:
    """A started simulator that belongs to one environment of this process until it is released.

    Attributes:
        name: as in the configuration.
        robot: the robot in it.
        scene: arranges its episodes.
        release: closes the connections and frees the simulator for another environment of any process. The
            simulator keeps running. Safe to repeat, and without effect in a forked process.
    """

    name: str
    robot: RobotinoAbc
    scene: Scene
    release: Callable[[], None]


def simulator_for(role: Role) -> Configured:
    """Return a started simulator for an environment that was created without one.

    It is one of PALAESTRA_CONFIG. If that is not set, as in a notebook, it is a stub with the arena, which
    ends when it is released, or with this process.

    Raises:
        ConfigurationError: each simulator with this role has an environment.
        SimulatorFault: the simulator does not start.
    """
    return configured_simulator(role) if os.environ.get(CONFIG_VARIABLE) else own_simulator()


def own_simulator() -> Configured:
    """Return a stub with the arena, started for this environment alone.

    Raises:
        SimulatorFault: it does not start.
    """
    arena = Arena()
    return Configured(name=arena.webots.robot_name, robot=arena.robot, scene=arena.scene, release=arena.close)


def configured_simulator(role: Role) -> Configured:
    """Return a started simulator with this role that no other environment uses.

    Raises:
        ConfigurationError: there is no configuration, or each simulator with this role has an environment.
        SimulatorFault: the simulator does not start.
    """
    configuration = load()
    allocated = allocate(configuration, role)
    try:
        [simulator] = connect(_alone(configuration, allocated.simulator.name))
        simulator.start()
    except BaseException:
        allocated.lock.release()
        raise

    def release() -> None:
        if allocated.lock.held:
            simulator.close()
            allocated.lock.release()

    return Configured(name=simulator.name, robot=simulator.robot, scene=simulator.scene, release=release)


def _alone(configuration: Configuration, name: str) -> Configuration:
    """Return a copy with this simulator only; not validated, because validation requires a collector."""
    chosen = tuple(simulator for simulator in configuration.simulators if simulator.name == name)
    return configuration.model_copy(update={"simulators": chosen})
