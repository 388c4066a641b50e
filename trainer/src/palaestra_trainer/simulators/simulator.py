"""A simulator of a run, with its facade, robot, scene and environment."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium

from palaestra_protocol.control import RobotName
from palaestra_protocol.scene import SceneState, VisibleScene
from palaestra_trainer.errors import ConfigurationError, SimulatorFault
from palaestra_trainer.job.simulator_configuration import Recycle
from palaestra_trainer.robots.base import RobotAbc, Scene
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.sight import Sight
from palaestra_trainer.robots.simulated import SimulatedRobot, SimulatedScene
from palaestra_trainer.simulators.recycle_policy import RecyclePolicy
from palaestra_trainer.webots import Mode, Webots
from palaestra_trainer.webots.facade import open_facades
from palaestra_trainer.webots.launching.sidecar import Sidecar

_POLL_S = 0.1

MakeEnvironment = Callable[[RobotAbc, Scene], gymnasium.Env[Any, Any]]


def driven_robot(robots: Sequence[RobotName], definition: str) -> RobotName | None:
    """Return the robot of a world that a robot class with this DEF name controls.

    Return the first robot with that DEF name, or else the first robot that is not a supervisor. Return None
    if all robots are supervisors and none has the name.
    """
    of_class = (each for each in robots if definition and each.definition == definition)
    others = (each for each in robots if not each.supervisor)
    return next(of_class, None) or next(others, None)


class Simulator:
    """A simulator behind a sidecar; its robot, scene and environment stay the same objects after a restart.

    Args:
        name: `<group>-<index>`, as in the configuration.
        sidecar: the sidecar, which starts and stops the simulator.
        make_environment: a function that creates the environment from robot and scene.
        start_deadline_s: the longest time to wait for the sidecar's first response, and for each start.
        recycle: limits after which the simulator is restarted between two episodes; None: no limits.
        robot: the class of the robot in the world.

    Attributes:
        reloads: whether the simulator loads its world again before each episode but the first; by default it
            does not.

    Raises:
        SimulatorDead, SimulatorHung: the sidecar does not report the robots' names.
        ConfigurationError: the world has no robot that is a supervisor.
    """

    def __init__(
        self,
        name: str,
        sidecar: Sidecar,
        make_environment: MakeEnvironment,
        start_deadline_s: float,
        recycle: Recycle | None = None,
        robot: type[SimulatedRobot] = Robotino,
    ) -> None:
        self.name = name
        self.sidecar = sidecar
        self.start_deadline_s = start_deadline_s
        self.wear = RecyclePolicy(recycle, self._memory)
        self.reloads = False
        self._abandoned = threading.Event()
        state = sidecar.first_state(start_deadline_s)
        supervisor = next((each for each in state.robots if each.supervisor), None)
        if supervisor is None:
            raise ConfigurationError(
                f"{name}: the world has no robot with supervisor TRUE; set supervisor TRUE on one robot"
            )
        driven = driven_robot(state.robots, robot.definition) or supervisor
        self.webots = Webots(
            supervisor.ros_name, state.world, launcher=sidecar, start_deadline_s=start_deadline_s
        )
        open_facades.withdraw(self.webots)
        self.robot = robot(self.webots, driven.ros_name, robots=[each.ros_name for each in state.robots])
        self.scene = SimulatedScene(self.webots, self.robot)
        self.env = make_environment(self.robot, self.scene)

    @property
    def resets(self) -> int:
        """The number of resets since the simulator was last started."""
        return self.scene.resets

    @property
    def simulated_s(self) -> float:
        """Seconds of simulated time since this object was created, over all restarts."""
        return self.robot.simulation.simulated_s

    def left_out(self) -> tuple[str, ...]:
        """Return the parts of its world that the simulator left out at its last start, as lines of text."""
        return self.sidecar.left_out

    def sight(self) -> Sight | None:
        """Return the positions of robot and target after the last step; None without a floor."""
        return self.scene.sight()

    def visible_scene(self) -> VisibleScene | None:
        """Return the visible shapes of the world; None: the simulator, such as Webots, cannot list them."""
        return self.webots.observer.scene()

    def visible_state(self) -> SceneState:
        """Return the poses after the last step, for a scene that `visible_scene` returned before."""
        return self.webots.observer.scene_state()

    def due(self, episodes: int = 1) -> str | None:
        """Return the reason to recycle the simulator before the next `episodes`, as text; None: no reason."""
        return self.wear.due(self.resets, episodes)

    def reload_due(self) -> bool:
        """Return whether the simulator must load its world again before the next episode."""
        return self.reloads and self.resets > 0

    def reload(self) -> None:
        """Load the world again and connect to it, so that the simulator can step.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: the world is not loaded in time.
        """
        self.webots.reload()
        self.unpause()
        self.robot.connect()

    def start(self) -> None:
        """Start the simulator and connect to it, so that it can step.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: the simulator does not start in time.
        """
        self.webots.start()  # this also connects the robot
        self.unpause()
        self.scene.resets = 0
        self.wear.begin()

    def restart(self) -> None:
        """Wait for the sidecar, stop the simulator in any state, and start it.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: the simulator or its sidecar does not start in time.
        """
        self.await_sidecar()
        self.stop()
        self.start()

    def await_sidecar(self) -> None:
        """Wait until the sidecar responds, because a kubelet needs some time to restart its container.

        Raises:
            SimulatorDead, SimulatorHung: the sidecar did not respond within `start_deadline_s` seconds.
        """
        self._abandoned.clear()
        give_up = time.monotonic() + self.start_deadline_s
        while True:
            try:
                self.sidecar.state()
            except SimulatorFault:
                if time.monotonic() > give_up or self._abandoned.wait(_POLL_S):
                    raise
            else:
                return

    def stop(self) -> None:
        """Stop the simulator, in any state."""
        self.robot.close()
        self.webots.stop()

    def close(self) -> None:
        """Close all connections; the simulator keeps running."""
        self.robot.close()
        self.webots.close()

    def abandon(self) -> None:
        """Kill the simulator, so that a start or restart in another thread fails soon."""
        self._abandoned.set()
        with contextlib.suppress(SimulatorFault):
            self.sidecar.expect_stop(0.0)

    def pause(self) -> None:
        """Pause the simulator, which then uses no processor time until `unpause`."""
        self.webots.supervisor.set_mode(Mode.PAUSE)

    def unpause(self) -> None:
        """End the pause."""
        self.webots.supervisor.set_mode(Mode.FAST)

    def _memory(self) -> int | None:
        # A sidecar that does not respond is not a reason to recycle its simulator.
        with contextlib.suppress(SimulatorFault):
            return self.sidecar.state().rss_bytes
        return None
