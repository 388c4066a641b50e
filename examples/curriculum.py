"""A curriculum with domain randomization: MoveToTargetEnv in a world that gets harder while the robot learns.

    palaestra run manifests/examples/curriculum.yaml

`level` grows from 0 to 1 in the first half of training. A higher level puts more cylinders on the floor, and
moves them farther from their positions in the world file. It also increases the noise of the distance
sensors, the slip of the wheels, and the share of commands that take effect one period late. Evaluations are
always at level 1. The episode's seed determines all random values, so an interrupted run resumes exactly.
"""

from typing import Any

import gymnasium
import numpy as np

from palaestra_trainer.environments.move_to_target import MoveToTargetEnv
from palaestra_trainer.environments.options import MoveToTargetOptions, parse
from palaestra_trainer.robots import Pose, RobotinoAbc, Scene, SceneWrapper

HARDEST_AT = 0.5  # share of training
# Values at level 1: maximum displacement, standard deviation, maximum slip, probability of a late command.
MOVED_M, NOISE_M, SLIP, LATE = 0.3, 0.01, 0.2, 0.3
UNDER_THE_FLOOR_M = -1.0


class DisturbedRobot(RobotinoAbc):
    """A robot with noise, slip and late commands; `begin` sets their strength."""

    def __init__(self, robot: RobotinoAbc) -> None:
        self.robot = robot
        self.begin(np.random.default_rng(0), 0.0)

    def begin(self, random: np.random.Generator, level: float) -> None:
        """Draw the values that are constant in an episode; keep `random` to draw the others during it."""
        self.random, self.level = random, level
        self.grip = 1.0 - level * random.uniform(0.0, SLIP)
        self.command, self.noise = (0.0, 0.0, 0.0), 0.0

    @property
    def period_s(self) -> float:
        """Seconds of a period."""
        return self.robot.period_s

    def distances(self) -> np.ndarray:
        """Return the distances of the robot, with the noise of this period."""
        return np.clip(self.robot.distances() + self.noise, *self.distance_range_m, dtype=np.float32)

    def bumped(self) -> bool:
        """Return whether the bumper touches an object."""
        return self.robot.bumped()

    def pose(self) -> Pose:
        """Return the true pose."""
        return self.robot.pose()

    def drive(self, vx: float, vy: float, omega: float) -> None:
        """Drive slower because of the slip; a late command takes effect in the next period."""
        before, self.command = self.command, (self.grip * vx, self.grip * vy, self.grip * omega)
        late = self.random.random() < LATE * self.level
        self.robot.drive(*(before if late else self.command))

    def advance(self) -> int:
        """Let a period pass, and draw the noise of this period's readings."""
        extra = self.robot.advance()
        self.noise = self.random.normal(0.0, NOISE_M * self.level, len(self.robot.distances()))
        return extra


class HarderScene(SceneWrapper):
    """A scene that puts cylinders on the floor and disturbs the robot, according to its level."""

    def __init__(self, robot: DisturbedRobot, scene: Scene) -> None:
        super().__init__(scene)
        self.robot, self.level = robot, 1.0

    def begin(self, seed: int) -> None:
        """Begin an episode; the seed and the level determine the scene."""
        self.scene.begin(seed)  # puts all objects back to their positions in the world file
        random = np.random.default_rng(seed)
        cylinders = [it for it in self.layout().obstacles if it.name.startswith("CYLINDER")]
        for number, cylinder in enumerate(cylinders):
            stands = number < round(self.level * len(cylinders))
            x, y = random.uniform(-self.level * MOVED_M, self.level * MOVED_M, 2)
            height = 0.5 * cylinder.top_m if stands else UNDER_THE_FLOOR_M
            self.put(cylinder.name, (float(cylinder.x_m + x), float(cylinder.y_m + y), height))
        self.robot.begin(random, self.level)


class CurriculumEnv(MoveToTargetEnv):
    """MoveToTargetEnv at a level that depends on the progress of training."""

    def __init__(self, robot: DisturbedRobot, scene: HarderScene, options: MoveToTargetOptions) -> None:
        super().__init__(robot, scene, options)
        self.harder = scene

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Any]:
        """Begin an episode at the level of the training progress; outside of a run, the level is 1."""
        progress = (options or {}).get("training_progress", 1.0)
        self.harder.level = min(1.0, progress / HARDEST_AT)
        return super().reset(seed=seed, options=options)


def make(robot: RobotinoAbc, scene: Scene, **options: Any) -> MoveToTargetEnv:
    """Return the environment of one simulator; a real robot is not disturbed, and nothing moves around it."""
    if robot.real:
        return MoveToTargetEnv(robot, scene, parse(options))
    disturbed = DisturbedRobot(robot)
    return CurriculumEnv(disturbed, HarderScene(disturbed, scene), parse(options))


gymnasium.register(id="Curriculum-v0", entry_point=make)
