"""The simulator of a facade that a program created before its environment, as in the paper.

The program starts, pauses and ends it: `with webots:` and `webots.run` decide when it steps.
"""

from __future__ import annotations

from palaestra_trainer.configuration import Environment as Wanted
from palaestra_trainer.environments.making import make_environment
from palaestra_trainer.robots.robotino import Robotino, RobotinoScene
from palaestra_trainer.webots import Webots
from palaestra_trainer.webots.offers import give_back, offered, take


class Offered:
    """Robot and scene in the simulator of a facade, which no other environment uses until `release`.

    The robot connects when the facade starts its simulator, or at once if it runs.

    Raises:
        SimulatorDead, SimulatorHung, WrongData: it runs, and the robot cannot connect.
    """

    def __init__(self, webots: Webots) -> None:
        self.webots = webots
        self.robot = Robotino(webots)
        self.scene = RobotinoScene(webots, self.robot)
        if webots.available():
            self.robot.connect()
        take(webots)

    def release(self) -> None:
        """Close the robot's connections and offer the facade again; safe to repeat."""
        self.robot.close()
        give_back(self.webots)


def offered_simulator() -> Offered | None:
    """Return the newest facade that no environment uses; None: this process has none."""
    webots = offered()
    return None if webots is None else Offered(webots)


class OfferedMember:
    """A member in such a simulator; it is restarted after faults, and started and paused by the program.

    Args:
        place: the simulator.
        wanted: the environment.

    Raises:
        ConfigurationError: the environment is unknown, or does not take what it is given.
    """

    def __init__(self, place: Offered, wanted: Wanted) -> None:
        self.name = place.webots.robot_name
        self.env = make_environment(wanted, place.robot, place.scene)
        self._place = place

    def due(self, episodes: int = 1) -> None:
        """It is not recycled: `webots.run(..., restart=True)` does that."""
        del episodes

    def start(self) -> None:
        """Leave the start to the program."""

    def stop(self) -> None:
        """Leave the simulator to the program, for another environment."""
        self._place.release()

    def restart(self) -> None:
        """Restart it; it runs as before, or is paused.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: it does not start in time.
            ConfigurationError: the facade is only attached to it.
        """
        self._place.webots()

    def abandon(self) -> None:
        """Do nothing: the start's own deadline ends it."""

    def pause(self) -> None:
        """Leave it to the program."""

    def unpause(self) -> None:
        """Leave it to the program."""
