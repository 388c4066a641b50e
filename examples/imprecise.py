"""MoveToTargetEnv for a policy that goes to a real robot: odometry drifts, wheels slip, commands get lost.

    palaestra run manifests/examples/imprecise.yaml

In every episode the odometry has other errors, and the wheels another slip. Some commands are lost, so the
robot stands for a period. The robot counts as arrived only within 0.10 m by its own odometry, so that it is
within 0.20 m of the target even if its odometry is wrong by some centimeters. The episode's seed determines
all random values. A real robot has such errors itself, so `make` adds none to it.
"""

import math
from typing import Any

import gymnasium
import numpy as np

from palaestra_trainer.environments.move_to_target import MoveToTargetEnv
from palaestra_trainer.environments.options import parse
from palaestra_trainer.robots import Pose, RobotinoAbc, Scene, SceneWrapper

SCALE, TURN_RAD_M = 0.03, 0.03  # greatest errors of the odometry: share of a way, and turn for each meter
SLIP, LOST = 0.15, 0.05  # greatest slip of the wheels, and the share of commands that are lost


class ImpreciseRobot(RobotinoAbc):
    """A robot whose odometry drifts, whose wheels slip, and which does not get all commands."""

    def __init__(self, robot: RobotinoAbc) -> None:
        self.robot = robot
        self.begin(np.random.default_rng(0))

    def begin(self, random: np.random.Generator) -> None:
        """Draw the errors of an episode."""
        self.random = random
        self.scale, self.turn_rad_m = (
            1.0 + random.uniform(-SCALE, SCALE),
            random.uniform(-TURN_RAD_M, TURN_RAD_M),
        )
        self.grip = 1.0 - random.uniform(0.0, SLIP)
        self.truth: Pose | None = None

    def start(self) -> None:
        """Begin to integrate odometry where the robot stands."""
        self.truth = self.odometry = self.robot.pose()

    @property
    def period_s(self) -> float:
        """Seconds of a period."""
        return self.robot.period_s

    def distances(self) -> np.ndarray:
        """Return the distances of the robot."""
        return self.robot.distances()

    def bumped(self) -> bool:
        """Return whether the bumper touches an object."""
        return self.robot.bumped()

    def pose(self) -> Pose:
        """Return the pose by odometry."""
        return self.odometry if self.truth else self.robot.pose()

    def drive(self, vx: float, vy: float, omega: float) -> None:
        """Drive slower because of the slip; a lost command lets the robot stand."""
        grip = 0.0 if self.random.random() < LOST else self.grip
        self.robot.drive(grip * vx, grip * vy, grip * omega)

    def advance(self) -> int:
        """Let a period pass, and integrate the odometry."""
        extra = self.robot.advance()
        if self.truth:
            self.odometry, self.truth = self._integrated(self.truth, self.robot.pose()), self.robot.pose()
        return extra

    def _integrated(self, before: Pose, after: Pose) -> Pose:
        """Return the odometry after a motion from `before` to `after`, with the errors of the episode."""
        dx, dy = after.x_m - before.x_m, after.y_m - before.y_m
        turned = math.remainder(after.heading_rad - before.heading_rad, 2.0 * math.pi)
        astray = self.odometry.heading_rad - before.heading_rad
        c, s = self.scale * math.cos(astray), self.scale * math.sin(astray)
        heading = self.odometry.heading_rad + turned + self.turn_rad_m * math.hypot(dx, dy)
        x_m, y_m = self.odometry.x_m + dx * c - dy * s, self.odometry.y_m + dx * s + dy * c
        return Pose(x_m, y_m, math.remainder(heading, 2.0 * math.pi))


class ImpreciseScene(SceneWrapper):
    """A scene that draws the errors of the robot when an episode begins."""

    def __init__(self, robot: ImpreciseRobot, scene: Scene) -> None:
        super().__init__(scene)
        self.robot = robot

    def begin(self, seed: int) -> None:
        """Begin an episode; the seed determines the errors."""
        self.scene.begin(seed)
        self.robot.begin(np.random.default_rng(seed))

    def place(self, start: Pose, target: tuple[float, float]) -> None:
        """Put the robot on its start, where its odometry begins without an error."""
        self.scene.place(start, target)
        self.robot.start()


class ImpreciseEnv(MoveToTargetEnv):
    """MoveToTargetEnv with a smaller distance to the target."""

    reached_m = 0.10


def make(robot: RobotinoAbc, scene: Scene, **options: Any) -> ImpreciseEnv:
    """Return the environment of one simulator, or of a real robot."""
    if robot.real:
        return ImpreciseEnv(robot, scene, parse(options))
    imprecise = ImpreciseRobot(robot)
    return ImpreciseEnv(imprecise, ImpreciseScene(imprecise, scene), parse(options))


gymnasium.register(id="Imprecise-v0", entry_point=make)
