"""The simulators that a gateway can show: those of a run on this machine, and those at a ROS master."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

from palaestra_protocol.control import RobotName, SidecarState, SimulatorState
from palaestra_protocol.scene import SceneState, VisibleScene
from palaestra_trainer.errors import ConfigurationError, SimulatorDead, SimulatorFault
from palaestra_trainer.job.configuration import load_run
from palaestra_trainer.job.simulator_configuration import SimulatorConfiguration
from palaestra_trainer.ros.master import Master
from palaestra_trainer.webots.launching.sidecar import Sidecar
from palaestra_trainer.webots.observer import Observer

_TIME: Final = "/robot/get_time"  # every robot's node has this service

_MASTER: Final = b"ROS_MASTER_URI="


class SceneReader(Protocol):
    """The interface of `Sidecar` and `Observer` that a gateway uses; methods raise SimulatorFault."""

    def scene(self) -> VisibleScene | None:
        """Return the visible objects of the world; None: the simulator does not describe its world."""
        ...

    def scene_state(self) -> SceneState:
        """Return the poses after the last step."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownRobot:
    """A robot of a running simulator.

    Attributes:
        place: a description of the simulator, for messages.
        reader: reads the scene of the simulator.
        name: the name of the robot in the world, which only a world with several robots needs.
        ros_name: the name of the robot's node in ROS 1.
        master_uri: the master of that node; None if it is not known.
    """

    place: str
    reader: SceneReader
    name: str
    ros_name: str
    master_uri: str | None


class RobotFinder(Protocol):
    """Finds the robot that a gateway shows, again after each restart of its simulator."""

    def refuse_missing(self) -> None:
        """Check that the simulator exists.

        Raises:
            ConfigurationError: the simulator does not exist; the message names the existing simulators.
        """
        ...

    def find(self) -> ShownRobot:
        """Return the robot.

        Raises:
            SimulatorFault, MasterLost: the simulator does not run now.
            ConfigurationError: the simulator has no such robot, or does not describe its world.
        """
        ...


class RunRobotFinder:
    """Finds a robot in a run directory of this machine; each start of the run has new addresses.

    Args:
        folder: the run directory.
        simulator: the name of the simulator, such as `collect-0`; None: the first.
        robot: the robot's name in its world or in ROS; None: the only robot.
    """

    def __init__(self, folder: Path, simulator: str | None = None, robot: str | None = None) -> None:
        self._folder = folder
        self._simulator = simulator
        self._robot = robot

    def refuse_missing(self) -> None:
        """Check that the run is running, and has the simulator and the robot; see `RobotFinder`."""
        simulator = self._configured()
        try:
            state = Sidecar(simulator.control, simulator.name).state()
        except SimulatorFault as error:
            raise ConfigurationError(
                f"{self._folder}: does not run ({error}); start the run first"
            ) from error
        chosen_robot(state.robots, self._robot)

    def find(self) -> ShownRobot:
        """Return the robot in the simulator that runs now: the first of its sidecar, or its standby."""
        simulator = self._configured()
        sidecar = Sidecar(simulator.control, simulator.name)
        sidecars = [sidecar, sidecar.standby()] if simulator.standby else [sidecar]
        for reader in sidecars:
            state = reader.state()
            if state.state is SidecarState.READY:
                robot = chosen_robot(state.robots, self._robot)
                return ShownRobot(
                    place=f"simulator {simulator.name} of {self._folder}",
                    reader=reader,
                    name=robot.robot,
                    ros_name=robot.ros_name,
                    master_uri=_master_of(state),
                )
        raise SimulatorDead(simulator.name, "does not run now")

    def _configured(self) -> SimulatorConfiguration:
        simulators = {each.name: each for each in load_run(self._folder).simulators}
        name = self._simulator or next(iter(simulators))
        if name not in simulators:
            known = ", ".join(simulators)
            raise ConfigurationError(f"--simulator {name}: the run has no such simulator; use one of {known}")
        return simulators[name]


class MasterRobotFinder:
    """Finds a robot by the name of its node at a ROS master, which ROS_MASTER_URI of this process must name.

    Args:
        uri: the URI of the master.
        robot: the name of the robot's node.
    """

    def __init__(self, uri: str, robot: str) -> None:
        self._master = Master(caller_id(), uri=uri)
        self._robot = robot.strip("/")

    def refuse_missing(self) -> None:
        """Check that the robot has a node; see `RobotFinder`."""
        robots = {name.split("/")[1] for name in self._master.services() if name.endswith(_TIME)}
        running = sorted(robot for robot in robots if self._master.runs(f"/{robot}"))
        if self._robot not in running:
            known = f"use one of {', '.join(running)}" if running else "no robot has a node"
            raise ConfigurationError(f"--robot {self._robot}: no robot has a node of this name; {known}")

    def find(self) -> ShownRobot:
        """Return the robot, if its node is registered now."""
        if self._master.service_address(f"/{self._robot}{_TIME}") is None:
            raise SimulatorDead(self._robot, "has no node now")
        return ShownRobot(
            place=f"node /{self._robot} at {self._master.uri}",
            reader=Observer(self._robot),
            name=self._robot,
            ros_name=self._robot,
            master_uri=self._master.uri,
        )


def caller_id() -> str:
    """Return the name under which this process asks masters and publishers."""
    return f"/palaestra_ros2_{os.getpid()}"


def chosen_robot(robots: Sequence[RobotName], wanted: str | None) -> RobotName:
    """Return the robot with the name `wanted` in its world or in ROS; without a name, the only robot.

    Raises:
        ConfigurationError: no robot has this name, or the name is missing.
    """
    known = ", ".join(each.robot or each.ros_name for each in robots)
    if wanted is None and len(robots) == 1:
        return robots[0]
    if wanted is None:
        fact = f"choose one of {known} with --robot" if robots else "it cannot be shown"
        raise ConfigurationError(f"the world has {len(robots)} robots with a node of ROS; {fact}")
    for each in robots:
        if wanted.strip("/") in {each.robot, each.ros_name}:
            return each
    raise ConfigurationError(f"--robot {wanted}: the world has no such robot; use one of {known}")


def shown_node(scene: VisibleScene, name: str) -> str:
    """Return the name of a robot's node in a scene.

    Raises:
        ConfigurationError: the scene does not have the robot.
    """
    robots = [node.name for node in scene.nodes if node.robot]
    if len(robots) == 1:
        return robots[0]
    if name in robots:
        return name
    raise ConfigurationError(f"{name}: the scene shows no such robot; it shows {', '.join(robots) or 'none'}")


def _master_of(state: SimulatorState) -> str | None:
    """Return the master of a simulator's process.

    training.yaml does not name the master. The environment variables of the process name it, and a user may
    read those of the user's own processes.
    """
    try:
        entries = Path(f"/proc/{state.pid}/environ").read_bytes().split(b"\0")
    except OSError:
        return None
    found = (entry.removeprefix(_MASTER) for entry in entries if entry.startswith(_MASTER))
    return next((uri.decode(errors="replace") for uri in found), None)
