"""Create the simulators of a configuration with their environments, without starting them.

`connect` uses the sidecars of a pod, `connect_members` adds the standbys, and `connect_here` starts new
sidecars as processes of this program.
"""

from __future__ import annotations

import os
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any
from uuid import uuid4

import gymnasium

import palaestra_trainer.environments  # noqa: F401 - the import registers the shipped environments
from palaestra_trainer.environments.make import make_environment
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import CONFIG_VARIABLE, DEFAULT_ROBOT, Configuration, load
from palaestra_trainer.job.simulator_configuration import SimulatorConfiguration
from palaestra_trainer.robots.simulated import SimulatedRobot, SimulatedScene
from palaestra_trainer.simulators.batch_simulator import BatchSimulator
from palaestra_trainer.simulators.fleet import limit_of
from palaestra_trainer.simulators.interface import Member
from palaestra_trainer.simulators.robot_registry import robot_class
from palaestra_trainer.simulators.simulator import Simulator
from palaestra_trainer.simulators.standby import Standby
from palaestra_trainer.webots import Attached, Mode, Webots, ensure_node
from palaestra_trainer.webots.facade import open_facades
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher
from palaestra_trainer.webots.launching.sidecar import Sidecar


def connect(configuration: Configuration | None = None) -> list[Simulator]:
    """Return the simulators of a configuration, by default of PALAESTRA_CONFIG, without starting them.

    Standbys are not created, because the caller always uses the same simulators.

    Raises:
        ConfigurationError: the configuration cannot be read, or its environment or robot is unknown.
        MasterLost: no ROS master responds.
        SimulatorDead, SimulatorHung: a sidecar does not respond.
    """
    chosen = configuration or load()
    ensure_node(f"trainer_r{chosen.replica}")
    return [simulator_at(Sidecar(entry.control, entry.name), chosen, entry) for entry in chosen.simulators]


def connect_members(configuration: Configuration) -> list[Member]:
    """Return the members of a configuration, without starting them, for a caller that restarts them.

    Raises:
        The same errors as `connect`.
    """
    if not all(entry.batch for entry in configuration.simulators):
        ensure_node(f"trainer_r{configuration.replica}")
    return [_member(configuration, entry) for entry in configuration.simulators]


def _member(configuration: Configuration, entry: SimulatorConfiguration) -> Member:
    """Return the member of an entry: a simulator with copies, a single simulator, or one with a standby."""
    sidecar = Sidecar(entry.control, entry.name)
    if entry.batch:
        return BatchSimulator(sidecar, configuration, entry)
    simulator = simulator_at(sidecar, configuration, entry)
    if not entry.standby:
        return simulator
    return Standby(simulator, simulator_at(sidecar.standby(), configuration, entry), limit_of(entry))


def connect_here(configuration: Configuration, run: Path) -> list[Simulator]:
    """Return the simulators of a run directory as processes of this program, without starting them.

    Raises:
        ConfigurationError: the run directory lacks a world, or a simulator cannot be started on this machine.
    """
    return [
        simulator_at(_process(configuration, entry, run), configuration, entry)
        for entry in configuration.simulators
    ]


# For each shipped world: the ROS name of its supervisor, and its robot as `trainer.robot` names it.
_WORLDS: dict[str, tuple[str, str]] = {
    "arena": ("robotino", DEFAULT_ROBOT),
    "seeing": ("robotino", DEFAULT_ROBOT),
    "court": ("burger", "TurtleBot3Burger"),
    "pen": ("epuck", "EPuck"),
}


def robot_of(world: str) -> str:
    """Return the robot in a shipped world, as `trainer.robot` names it."""
    _, robot = _WORLDS[world]
    return robot


def robot_for(world: str) -> type[SimulatedRobot]:
    """Return the robot class of PALAESTRA_CONFIG, or of the shipped `world` if that variable is not set.

    Raises:
        ConfigurationError: the configuration cannot be read, or its robot class does not exist.
    """
    if os.environ.get(CONFIG_VARIABLE):
        return robot_class(load().robot or DEFAULT_ROBOT)
    return robot_class(robot_of(world))


class OwnSimulator:
    """A new simulator with a shipped world, as a process of this program; `close` ends it.

    Args:
        world: the name of the shipped world, such as `arena`.
        driver: the simulator program, `stub` or `mujoco`.

    Raises:
        SimulatorDead, SimulatorHung, WrongData: the simulator does not start in time.
    """

    def __init__(self, world: str = "arena", driver: str = "stub") -> None:
        supervisor, robot = _WORLDS[world]
        self.webots = Webots(supervisor, world, driver=driver)
        open_facades.withdraw(self.webots)
        self.robot = robot_class(robot)(self.webots)
        self.scene = SimulatedScene(self.webots, self.robot)
        with ExitStack() as undo:
            undo.callback(self.close)
            self.webots.start()  # this also connects the robot
            self.webots.supervisor.set_mode(Mode.FAST)
            undo.pop_all()

    def close(self) -> None:
        """End the simulator; further calls have no effect."""
        self.robot.close()
        self.webots.close()


def unconnected_environment(configuration: Configuration, name: str) -> gymnasium.Env[Any, Any]:
    """Return an environment without a simulator; a call that needs the simulator raises SimulatorDead.

    Args:
        configuration: defines the environment and its robot.
        name: the name of the simulator in that error.

    Raises:
        ConfigurationError: the environment is unknown, or it does not accept its options or this robot.
    """
    webots = Webots(name, configuration.simulators[0].world, launcher=Attached())
    open_facades.withdraw(webots)
    robot = robot_class(configuration.robot or DEFAULT_ROBOT)(webots)
    return make_environment(configuration.environment, robot, SimulatedScene(webots, robot))


def new_simulator(
    configuration: Configuration, entry: SimulatorConfiguration
) -> tuple[Simulator, ProcessLauncher]:
    """Return a simulator in a new process of this machine, not started, and the launcher of that process.

    Other simulators of the same world may run, because the ROS names of this simulator get a random suffix.

    Raises:
        ConfigurationError: the sidecar refused the world or the driver, or `simulator_at` raised this error.
    """
    # A stub ignores a suffix of six hexadecimal digits when it seeds its faults, so the faults are
    # repeatable.
    launcher = ProcessLauncher(entry.world, entry.driver, suffix=f"_{entry.index}_{uuid4().hex[:6]}")
    with ExitStack() as undo:
        undo.callback(launcher.close)
        simulator = simulator_at(launcher, configuration, entry)
        undo.pop_all()
    return simulator, launcher


def _process(configuration: Configuration, entry: SimulatorConfiguration, run: Path) -> ProcessLauncher:
    # The run directory may have been moved, so its worlds are searched for inside its current path. Worlds
    # that the image ships are outside of the run directory.
    inside = run / "worlds" / Path(entry.world).name
    world = inside if inside.exists() else Path(entry.world)
    if not world.exists() or entry.driver == "command":
        missing = f"the program of driver {entry.driver}" if world.exists() else f"the world {world}"
        raise ConfigurationError(
            f"{entry.name}: {missing} is not on this machine; copy the whole run directory, or evaluate in "
            "the pod"
        )
    names = (
        f"--job={configuration.job}",
        f"--namespace={configuration.namespace}",
        f"--uid={configuration.uid}",
        f"--replica={configuration.replica}",
        f"--group={entry.group}",
        f"--index={entry.index}",
        f"--work={run / 'scratch' / f'{entry.name}-here'}",
    )
    return ProcessLauncher(world.absolute(), entry.driver, entry.options, names)


def simulator_at(sidecar: Sidecar, configuration: Configuration, entry: SimulatorConfiguration) -> Simulator:
    """Return the simulator behind a sidecar with the configured environment, without starting it.

    Raises:
        ConfigurationError: the environment is unknown, or it does not accept its options or this robot.
        SimulatorDead, SimulatorHung: the sidecar does not respond.
    """
    make = partial(make_environment, configuration.environment)
    robot = robot_class(configuration.robot or DEFAULT_ROBOT)
    simulator = Simulator(entry.name, sidecar, make, entry.start_deadline_seconds, entry.recycle, robot)
    simulator.reloads = entry.reset is not None
    return simulator
