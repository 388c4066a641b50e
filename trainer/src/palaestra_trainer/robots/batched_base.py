"""The interfaces of the copies of a robot, and of the scene around them: readings and commands are arrays.

Row i of every array belongs to copy i. An environment that is written with arrays uses only these classes, as
a single environment uses those of `robots.base`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.robots.geometry import Pose
from palaestra_trainer.robots.layout import FloorLayout

Floats = NDArray[np.float64]
Rows = NDArray[np.int64]


class BatchedRobotAbc(ABC):
    """The copies of a robot.

    Attributes:
        rows: the number of copies.
        period_s: simulated seconds of one `advance`.
        failed: for each row, whether its copy failed since its last reset: its readings are not valid.
        reasons: the reasons of failures, by row; a failed row may lack a reason.
    """

    rows: int
    period_s: float
    failed: NDArray[np.bool_]
    reasons: Mapping[int, str]

    @abstractmethod
    def advance(self) -> None:
        """Simulate one period of all rows.

        Raises:
            SimulatorDead, SimulatorHung, WrongData
        """


class BatchedRobotinoAbc(BatchedRobotAbc):
    """The copies of a Robotino."""

    @property
    @abstractmethod
    def radius_m(self) -> float:
        """The radius of a robot's outline."""

    @abstractmethod
    def drive(self, vx: Floats, vy: Floats, omega: Floats) -> None:
        """Set the velocities until the next command: forward, left (m/s), counter-clockwise (rad/s)."""

    @abstractmethod
    def distances(self) -> NDArray[np.float32]:
        """Return meters to the nearest obstacles, (rows, 9), counter-clockwise from forward."""

    @abstractmethod
    def bumped(self) -> NDArray[np.bool_]:
        """Return for each row whether its bumper touches something."""

    @abstractmethod
    def poses(self) -> Floats:
        """Return x and y in meters and the heading in radians of each row's robot: (rows, 3)."""


class BatchedJointsAbc(BatchedRobotAbc):
    """The copies of a robot with joints."""

    @property
    @abstractmethod
    def greatest(self) -> Floats:
        """The greatest command of each motor: (motors,)."""

    @abstractmethod
    def joints(self) -> Floats:
        """Return the readings of the sensors: (rows, sensors)."""

    @abstractmethod
    def command(self, values: Floats) -> None:
        """Set the commands of the motors (rows, motors), clipped to `greatest`, until the next command."""


class BatchedSceneAbc(ABC):
    """The scene around the copies of a robot."""

    @abstractmethod
    def use_joints(self, *names: str) -> None:
        """Name the joints whose positions `begin` sets; call this in the constructor of an environment."""

    @abstractmethod
    def layout(self) -> FloorLayout:
        """Return the floor and the objects on it, which are the same in every row.

        Raises:
            ConfigurationError: the world has no floor.
        """

    @abstractmethod
    def begin(
        self,
        rows: Rows,
        seeds: Sequence[int],
        *,
        starts: Sequence[Pose] | None = None,
        joints: Floats | None = None,
        commands: Floats | None = None,
    ) -> None:
        """Begin an episode in rows, in increasing order, and simulate one period of these rows.

        All random values of a row until its next `begin` follow from its seed.

        Args:
            rows: the numbers of the rows.
            seeds: one seed for each of these rows.
            starts: the pose of each row's robot; None for robots that do not drive.
            joints: the positions of the joints of `use_joints`: (rows, joints).
            commands: the commands of the motors: (rows, motors); None: wheels stand, and other motors keep
                the commands that the world sets.

        Raises:
            SimulatorDead, SimulatorHung, WrongData
        """
