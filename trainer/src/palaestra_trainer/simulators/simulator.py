"""One simulator of a training run: its facade, its robot, its scene, and its environment."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium

from palaestra_trainer.errors import WrongData
from palaestra_trainer.robots.base import RobotinoAbc, Scene
from palaestra_trainer.robots.robotino import Robotino, RobotinoScene
from palaestra_trainer.simulators.sidecar import Sidecar
from palaestra_trainer.webots import Mode, Webots

MakeEnvironment = Callable[[RobotinoAbc, Scene], gymnasium.Env[Any, Any]]


class Simulator:
    """A simulator behind a sidecar; robot, scene and environment stay the same objects over restarts.

    Args:
        name: `<group>-<index>`, as in the configuration.
        sidecar: where the simulator is started and stopped.
        make_environment: makes the environment from robot and scene.
        start_deadline_s: the longest time until the sidecar, and after a start the simulator, answers.

    Raises:
        SimulatorDead, SimulatorHung: the sidecar cannot be asked for the robots' names.
        WrongData: the world has no robot that is a supervisor.
    """

    def __init__(
        self, name: str, sidecar: Sidecar, make_environment: MakeEnvironment, start_deadline_s: float
    ) -> None:
        self.name = name
        state = sidecar.first_state(start_deadline_s)
        supervisor = next((robot for robot in state.robots if robot.supervisor), None)
        if supervisor is None:
            raise WrongData(name, "the world has no robot with supervisor TRUE; give it one")
        driven = next((robot for robot in state.robots if not robot.supervisor), supervisor)
        self.webots = Webots(
            supervisor.ros_name, state.world, launcher=sidecar, start_deadline_s=start_deadline_s
        )
        self.robot = Robotino(self.webots, driven.ros_name, robots=[robot.ros_name for robot in state.robots])
        self.scene = RobotinoScene(self.webots, self.robot)
        self.env = make_environment(self.robot, self.scene)

    @property
    def resets(self) -> int:
        """Resets since the simulator was last started."""
        return self.scene.resets

    def start(self) -> None:
        """Start the simulator and connect to it, ready to step.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: it does not come up in time.
        """
        self.webots.start()
        self.run()
        self.robot.connect()
        self.scene.resets = 0

    def restart(self) -> None:
        """Stop the simulator, however it is, and start it.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: it does not come up in time.
        """
        self.stop()
        self.start()

    def stop(self) -> None:
        """Stop the simulator, however it is."""
        self.robot.close()
        self.webots.stop()

    def pause(self) -> None:
        """Let the simulator rest: it uses no processor until `run`."""
        self.webots.supervisor.set_mode(Mode.PAUSE)

    def run(self) -> None:
        """End the rest that `pause` began."""
        self.webots.supervisor.set_mode(Mode.FAST)
