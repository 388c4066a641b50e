"""One simulator of a training run: its facade, its robot, its scene, and its environment."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium

from palaestra_protocol.control import RobotName
from palaestra_trainer.errors import ConfigurationError, SimulatorFault
from palaestra_trainer.job.configuration import Recycle
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
    """Return the robot of a world that a class with this DEF name drives.

    It is the first robot with that name. If no robot has it, it is the first one that is not a supervisor.
    None: all robots are supervisors.
    """
    of_class = (each for each in robots if definition and each.definition == definition)
    others = (each for each in robots if not each.supervisor)
    return next(of_class, None) or next(others, None)


class Simulator:
    """A simulator behind a sidecar; robot, scene and environment stay the same objects over restarts.

    Args:
        name: `<group>-<index>`, as in the configuration.
        sidecar: starts and stops the simulator.
        make_environment: creates the environment from robot and scene.
        start_deadline_s: the longest wait in seconds for the sidecar's first response, and for each start.
        recycle: limits at which it is restarted between two episodes; by default never.
        robot: the class of the robot in its world.

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
        self._abandoned = threading.Event()
        state = sidecar.first_state(start_deadline_s)
        supervisor = next((each for each in state.robots if each.supervisor), None)
        if supervisor is None:
            raise ConfigurationError(f"{name}: the world has no robot with supervisor TRUE; set it on one")
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
        """Resets since the simulator was last started."""
        return self.scene.resets

    @property
    def simulated_s(self) -> float:
        """Seconds of simulated time since this object was created, over all restarts."""
        return self.robot.simulation.simulated_s

    def left_out(self) -> tuple[str, ...]:
        """Return the parts of its world that the simulator left out at its last start, as text lines."""
        return self.sidecar.left_out

    def sight(self) -> Sight | None:
        """Return where robot and target are after the last step; None: not on a floor."""
        return self.scene.sight()

    def due(self, episodes: int = 1) -> str | None:
        """Return the reason to recycle it before the next `episodes`, as text; None: no reason."""
        return self.wear.due(self.resets, episodes)

    def start(self) -> None:
        """Start the simulator and connect to it, ready to step.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: it does not start in time.
        """
        self.webots.start()  # connects the robot too
        self.unpause()
        self.scene.resets = 0
        self.wear.begin()

    def restart(self) -> None:
        """Wait for the sidecar, stop the simulator in any state, and start it.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: it, or its sidecar, does not start in time.
        """
        self.await_sidecar()
        self.stop()
        self.start()

    def await_sidecar(self) -> None:
        """Wait until the sidecar responds; a kubelet needs some time to restart a container.

        Raises:
            SimulatorDead, SimulatorHung: it did not respond within `start_deadline_s` seconds.
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
        """Make a start or restart in another thread fail soon, by killing the simulator."""
        self._abandoned.set()
        with contextlib.suppress(SimulatorFault):
            self.sidecar.expect_stop(0.0)

    def pause(self) -> None:
        """Pause the simulator: it uses no processor time until `unpause`."""
        self.webots.supervisor.set_mode(Mode.PAUSE)

    def unpause(self) -> None:
        """End the pause."""
        self.webots.supervisor.set_mode(Mode.FAST)

    def _memory(self) -> int | None:
        # A sidecar that does not respond is not a reason to recycle its simulator.
        with contextlib.suppress(SimulatorFault):
            return self.sidecar.state().rss_bytes
        return None
