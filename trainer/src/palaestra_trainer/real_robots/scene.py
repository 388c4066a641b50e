"""The floor of a real robot, on which a person places the robot for each episode."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from palaestra_trainer.errors import RobotStopped
from palaestra_trainer.real_robots.frames import wrapped
from palaestra_trainer.real_robots.robotino import RealRobotino
from palaestra_trainer.robots.base import Scene
from palaestra_trainer.robots.geometry import Point, Pose
from palaestra_trainer.robots.layout import FloorLayout

Ask = Callable[[Pose], None]  # asks a person to place the robot at a pose, and returns when that is done

# If the robot is this near to the pose, the person need not place it: odometry is not more precise.
_THERE_M: Final = 0.02
_THERE_RAD: Final = 0.05
_OPEN_FLOOR_M: Final = 1000.0


class RealScene(Scene):
    """Begins episodes on a real floor, on which only the robot is moved, and only by a person.

    The layout is the fence without obstacles, because nobody has measured the floor.

    Args:
        robot: the robot.
        ask: called with the pose at which an episode begins, unless the robot already stands there.
    """

    def __init__(self, robot: RealRobotino, ask: Ask) -> None:
        self._robot = robot
        self._ask = ask
        self.target: Point | None = None

    def begin(self, seed: int) -> None:
        """Stop the robot. The seed has no effect, because a real floor has no random values to set."""
        del seed
        self._robot.stand()

    def layout(self) -> FloorLayout:
        """Return the floor within the fence; without a fence, a floor of 2 km x 2 km."""
        if (fence := self._robot.rules.fence) is not None:
            return FloorLayout(low=fence.low, high=fence.high)
        return FloorLayout(low=(-_OPEN_FLOOR_M, -_OPEN_FLOOR_M), high=(_OPEN_FLOOR_M, _OPEN_FLOOR_M))

    def place(self, start: Pose, target: Point) -> None:
        """Begin at `start`; if odometry says that the robot stands elsewhere, a person places it there."""
        if _is_near(self._robot.pose(), start):
            self._robot.begin()
        else:
            self._ask(start)
            self._robot.stand_at(start)
        self.target = target

    def mark(self, target: Point) -> None:
        """Remember the new target; a real floor has no mark."""
        self.target = target

    def put(self, name: str, place: tuple[float, float, float]) -> None:
        """Refuse: only a simulation can move objects."""
        del place
        raise RobotStopped(
            f"the task moves {name}, which only a simulation can do; deploy a policy whose task moves nothing"
        )


def _is_near(found: Pose, wanted: Pose) -> bool:
    away = abs(complex(found.x_m - wanted.x_m, found.y_m - wanted.y_m))
    return away <= _THERE_M and abs(wrapped(found.heading_rad - wanted.heading_rad)) <= _THERE_RAD
