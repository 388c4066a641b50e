"""Use the simulator of a facade that a program created before its environment.

The program starts, pauses and stops the simulator. Steps run inside `with webots:` and `webots.run`.
"""

from __future__ import annotations

from typing import Any

import gymnasium

from palaestra_trainer.environments.make import make_environment
from palaestra_trainer.errors import SimulatorDead
from palaestra_trainer.job.configuration import Environment as Wanted
from palaestra_trainer.robots.simulated import SimulatedRobot, SimulatedScene
from palaestra_trainer.simulators.connect import robot_for
from palaestra_trainer.simulators.interface import Environment, Step
from palaestra_trainer.webots import Webots
from palaestra_trainer.webots.facade import open_facades


class NotebookSimulator:
    """Robot and scene in the simulator of a facade, reserved for one environment until `release`.

    The robot connects when the facade starts its simulator. If the simulator already runs, the robot connects
    at once.

    Args:
        webots: the facade.
        robot: the class of the robot in the facade's world.

    Raises:
        SimulatorDead, SimulatorHung, WrongData: the simulator runs, but the robot cannot connect.
    """

    def __init__(self, webots: Webots, robot: type[SimulatedRobot]) -> None:
        self.webots = webots
        self.robot = robot(webots)
        self.scene = SimulatedScene(webots, self.robot)
        if webots.available():
            self.robot.connect()
        open_facades.take(webots)

    def release(self) -> None:
        """Close the robot's connections and make the facade available again; further calls have no effect."""
        self.robot.close()
        open_facades.give_back(self.webots)


def offered_simulator(world: str) -> NotebookSimulator | None:
    """Return the simulator of the newest facade that no environment uses; None without such a facade.

    The robot has the class in PALAESTRA_CONFIG, or if that variable is not set, the class of the robot in the
    shipped `world`.
    """
    webots = open_facades.offered()
    return None if webots is None else NotebookSimulator(webots, robot_for(world))


class NotebookMember:
    """A member in a facade's simulator, which the program starts and pauses, and the trainer restarts.

    Args:
        place: the facade's simulator, with robot and scene.
        wanted: the id and the options of the environment to create.

    Raises:
        ConfigurationError: the environment is unknown, or does not accept its options or the robot.
    """

    def __init__(self, place: NotebookSimulator, wanted: Wanted) -> None:
        self.name = place.webots.robot_name
        self._one_life = _OneLife(make_environment(wanted, place.robot, place.scene), self.name)
        self.env: Environment = self._one_life
        self._webots = place.webots
        self._place = place
        place.webots.at_start(f"environment of {self.name}", self._one_life.end)

    def due(self, episodes: int = 1) -> None:
        """Return None; only the program recycles the simulator, by `webots.run(..., restart=True)`."""
        del episodes

    def start(self) -> None:
        """Do nothing, because the program starts the simulator."""

    def stop(self) -> None:
        """Release the simulator for another environment, without stopping it."""
        self._place.release()

    def restart(self) -> None:
        """Restart the simulator, unless the program has already restarted it.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: the simulator does not start in time.
            ConfigurationError: the facade is attached to a simulator that it did not start.
        """
        if not (self._one_life.ended and self._webots.available()):
            self._webots()

    def abandon(self) -> None:
        """Do nothing, because a start has its own deadline."""

    def pause(self) -> None:
        """Do nothing, because the program pauses its simulator itself."""

    def unpause(self) -> None:
        """Do nothing, because the program pauses its simulator itself."""


class _OneLife(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment whose episode ends when the program restarts the simulator.

    Attributes:
        ended: whether the simulator was started since the last reset.
    """

    def __init__(self, env: Environment, name: str) -> None:
        super().__init__(env)
        self._name = name
        self.ended = False

    def end(self) -> None:
        """Record that the simulator was started."""
        self.ended = True

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Return the result of the environment's reset."""
        self.ended = False
        return self.env.reset(seed=seed, options=options)

    def step(self, action: Any) -> Step:
        """Return the result of the environment's step.

        Raises:
            SimulatorDead: the simulator of this episode has ended, or the environment raised this error.
        """
        if self.ended:
            raise SimulatorDead(self._name, "was restarted during the episode")
        return self.env.step(action)
