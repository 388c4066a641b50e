"""Find or start a simulator for an environment that was created without one.

Each environment gets its own simulator: the simulator of a `Webots` facade of the program, a simulator of
PALAESTRA_CONFIG, or a new simulator.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass

from palaestra_protocol.pod.enums import Role
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import CONFIG_VARIABLE, Configuration, load
from palaestra_trainer.robots.base import RobotAbc, Scene
from palaestra_trainer.simulators.allocation import allocate
from palaestra_trainer.simulators.connect import OwnSimulator, connect
from palaestra_trainer.simulators.notebook_simulator import offered_simulator


@dataclass(frozen=True, slots=True, kw_only=True)
class Configured:
    """A started simulator that belongs to one environment of this process until `release`.

    Attributes:
        name: name of the simulator in the configuration.
        robot: the robot in the simulator.
        scene: the scene of the robot.
        release: closes the connections and frees the simulator for another environment of any process. A
            simulator that was not started for this environment keeps running. Further calls, and calls in a
            forked process, have no effect.
    """

    name: str
    robot: RobotAbc
    scene: Scene
    release: Callable[[], None]


def simulator_for(role: Role, world: str = "arena", driver: str = "stub") -> Configured:
    """Return a started simulator for an environment that was created without one.

    If this process has a `Webots` facade that no environment uses, return the simulator of that facade.
    Otherwise return a simulator of PALAESTRA_CONFIG. If that variable is not set, as in a notebook, start a
    new simulator with this world and driver. The new simulator ends when it is released, or with this
    process.

    Raises:
        ConfigurationError: each simulator with this role has an environment, or MuJoCo is not installed.
        SimulatorFault: the simulator does not start.
    """
    found = offered_simulator(world)
    if found is not None:
        name = found.webots.robot_name
        return Configured(name=name, robot=found.robot, scene=found.scene, release=found.release)
    return configured_simulator(role) if os.environ.get(CONFIG_VARIABLE) else own_simulator(world, driver)


def own_simulator(world: str = "arena", driver: str = "stub") -> Configured:
    """Start a new simulator for one environment and return it.

    Raises:
        ConfigurationError: the driver is `mujoco`, but MuJoCo is not installed.
        SimulatorFault: the simulator does not start.
    """
    require_driver(driver)
    own = OwnSimulator(world, driver)
    return Configured(name=own.webots.robot_name, robot=own.robot, scene=own.scene, release=own.close)


def require_driver(driver: str) -> None:
    """Check that simulators of this driver can be started on this machine.

    Raises:
        ConfigurationError: the driver is `mujoco`, but MuJoCo is not installed.
    """
    if driver == "mujoco" and importlib.util.find_spec("mujoco") is None:
        raise ConfigurationError(
            "simulator: none was given, and driver mujoco needs the Python package mujoco, which is not "
            "installed; install palaestra-sim[mujoco]"
        )


def configured_simulator(role: Role) -> Configured:
    """Return a started simulator with this role that no other environment uses.

    Raises:
        ConfigurationError: PALAESTRA_CONFIG is not set, or each simulator with this role has an environment.
        SimulatorFault: the simulator does not start.
    """
    configuration = load()
    allocated = allocate(configuration, role)
    with ExitStack() as undo:
        undo.callback(allocated.lock.release)
        [simulator] = connect(_alone(configuration, allocated.simulator.name))
        simulator.start()
        undo.pop_all()

    def release() -> None:
        if allocated.lock.held:
            simulator.close()
            allocated.lock.release()

    return Configured(name=simulator.name, robot=simulator.robot, scene=simulator.scene, release=release)


def _alone(configuration: Configuration, name: str) -> Configuration:
    """Return a copy with only this simulator; validation would refuse it without a collecting simulator."""
    chosen = tuple(simulator for simulator in configuration.simulators if simulator.name == name)
    return configuration.model_copy(update={"simulators": chosen})
