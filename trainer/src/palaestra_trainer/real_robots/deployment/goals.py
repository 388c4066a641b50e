"""Drive a robot to goals that arrive while the program runs, one episode for each goal."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from palaestra_trainer.errors import ConfigurationError, RobotStopped, TrainerError
from palaestra_trainer.real_robots.camera import ImageSize
from palaestra_trainer.real_robots.deployment.deploy import Deployment
from palaestra_trainer.real_robots.frames import OdometryFrame
from palaestra_trainer.real_robots.link import RobotLink
from palaestra_trainer.real_robots.readings import ReadingStore
from palaestra_trainer.real_robots.robotino import RealRobotino
from palaestra_trainer.robots.geometry import Point, Pose, Twist
from palaestra_trainer.waiting.check import Check

_LOOK_S: Final = 0.05
_OF_ODOMETRY: Final = OdometryFrame(Pose(0.0, 0.0, 0.0))  # the frame of the goals
Say = Callable[[str], object]


class NewGoal(TrainerError):
    """A newer goal has arrived, so the episode ends."""


class Goals:
    """Holds the newest goal; any thread may put one."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._newest: Point | None = None

    @property
    def waits(self) -> bool:
        """Whether a goal waits to be taken."""
        return self._newest is not None

    def put(self, goal: Point) -> None:
        """Keep a goal, in place of an older goal: x, y in meters of the frame of odometry."""
        with self._changed:
            self._newest = goal
            self._changed.notify()

    def take(self, check: Check) -> Point:
        """Wait for a goal, and return it; `check` is called often, and may raise to end the wait."""
        while True:
            check()
            with self._changed:
                if self._newest is None:
                    self._changed.wait(_LOOK_S)
                goal, self._newest = self._newest, None
            if goal is not None:
                return goal


class QuietLink:
    """A connection that sends no command while the policy has no goal, so that other nodes may drive.

    Args:
        link: the connection to the robot.

    Attributes:
        address: the address of the robot.
        quiet: whether no command is sent.
    """

    def __init__(self, link: RobotLink) -> None:
        self.address = link.address
        self.quiet = True
        self._link = link

    def refuse_unfit(self, speed_m_s: float, turn_rad_s: float) -> None:
        """Refuse a robot that must not be driven."""
        self._link.refuse_unfit(speed_m_s, turn_rad_s)

    def start(self, store: ReadingStore) -> None:
        """Begin to put readings into `store`."""
        self._link.start(store)

    def use_camera(self, store: ReadingStore, size: ImageSize) -> None:
        """Begin to put images into `store`."""
        self._link.use_camera(store, size)

    def send(self, twist: Twist) -> None:
        """Send one velocity, unless the connection is quiet."""
        if not self.quiet:
            self._link.send(twist)

    def close(self) -> None:
        """End the connection."""
        self._link.close()


class GoalDriver:
    """Drives a robot to goals, and lets it stand in between.

    Args:
        robot: the connected robot.
        link: its connection.
        deployment: the policy on this robot.
        goals: the goals.
    """

    def __init__(
        self,
        robot: RealRobotino,
        link: QuietLink,
        deployment: Deployment,
        goals: Goals,
    ) -> None:
        self._robot = robot
        self._link = link
        self._deployment = deployment
        self._goals = goals

    def run(self, check: Check, say: Say, warn: Say) -> None:
        """Drive to each goal that arrives, until `check` raises.

        Args:
            check: called often while no goal waits.
            say: called with a line at the start and the end of each episode.
            warn: called with a line if an episode cannot begin, or a safety rule has stopped the robot.
        """
        while True:
            goal = self._goals.take(check)
            try:
                say(f"driving to ({goal[0]:.2f}, {goal[1]:.2f})")
                say(self._outcome(goal))
            except NewGoal:
                continue
            except (ConfigurationError, RobotStopped) as error:
                warn(f"{error}; the robot stands until the next goal")
            self._rest()

    def _outcome(self, goal: Point) -> str:
        """Drive an episode in the frame of odometry, and return its end.

        Raises:
            NewGoal: the robot's check found a newer goal.
        """
        self._link.quiet = False
        self._robot.begin(_OF_ODOMETRY)
        end = self._deployment.drive(goal)
        return f"{end.outcome} after {end.steps} steps"

    def _rest(self) -> None:
        # These errors are ignored. If a safety rule has stopped the robot, the robot may still move for a
        # moment. If a newer goal has arrived, its episode begins with a stop anyway.
        with suppress(NewGoal, RobotStopped):
            self._robot.stand()
        self._link.quiet = True
