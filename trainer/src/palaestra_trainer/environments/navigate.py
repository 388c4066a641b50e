"""The task to drive to the target between obstacles that a laser scanner detects.

The environment consists of a scene and any robot that can steer, scan and report its pose. It depends on
neither ROS nor Webots. It does not catch a `SimulatorFault` of the robot.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from palaestra_trainer.environments.observation import in_frame, velocity
from palaestra_trainer.environments.options import NavigateOptions
from palaestra_trainer.environments.placement import FreePlaces
from palaestra_trainer.environments.rewards import EpisodeOutcome, Transition
from palaestra_trainer.environments.step_result import result
from palaestra_trainer.robots.base import RobotAbc, Scene
from palaestra_trainer.robots.capabilities import Localization, Scanner, Steering, require
from palaestra_trainer.robots.geometry import Point, Pose

REACHED_M = 0.15
# If an object is nearer than this to the robot's outline, the robot counts as collided, because a scanner may
# not detect an object that touches the robot.
BUMPED_M = 0.05
SECTORS = 24
SEEN_M = 0.8  # a sector counts as empty if its nearest object is farther than this
TARGET_M = 2.0  # the unit of the distance to the target
# The movements as shares of the robot's greatest speeds: forward, counter-clockwise.
MOVES = ((0.9, 0.0), (0.55, 0.33), (0.55, -0.33), (0.0, 0.55), (0.0, -0.55))

Observation = NDArray[np.float32]
Info = dict[str, Any]


class NavigateEnv(gymnasium.Env[Observation, Any]):
    """Drive to the target, to within 0.15 m, between obstacles that the scanner detects.

    The task was made for a TurtleBot3 Burger in the world `court`, a floor of 3 x 3 m with two boxes and two
    cylinders. It works with any robot that has `Steering`, `Scanner` and `Localization`. Start, heading and
    target differ in every episode. A step is one control period of the robot (0.192 s in simulation), in
    which a Burger drives 4 cm.

    ## Actions

    `actions="discrete"`: `Discrete(5)`, in shares of the robot's greatest speeds:

    | action | movement    | forward | turning |
    |--------|-------------|---------|---------|
    | 0      | straight on | 0.9     | 0       |
    | 1      | curve left  | 0.55    | 0.33    |
    | 2      | curve right | 0.55    | -0.33   |
    | 3      | turn left   | 0       | 0.55    |
    | 4      | turn right  | 0       | -0.55   |

    `actions="continuous"`: `Box(-1, 1, (2,), float32)`

    | index | meaning                   | unit     | min | max |
    |-------|---------------------------|----------|-----|-----|
    | 0     | velocity forward          | greatest | -1  | 1   |
    | 1     | turning counter-clockwise | greatest | -1  | 1   |

    ## Observation

    The space is a `Box(float32)`. A sector is a 24th of the scanner's view. The first sector is the
    rightmost; for a view of 360 degrees it begins behind the robot. The other sectors follow
    counter-clockwise.

    | index | meaning                                         | unit     | min  | max |
    |-------|-------------------------------------------------|----------|------|-----|
    | 0-23  | nearness of the nearest object in a sector      | 0.8 m    | 0    | 1   |
    | 24    | velocity forward, mean over the step            | greatest | -1.5 | 1.5 |
    | 25    | turning, mean over the step                     | greatest | -1.5 | 1.5 |
    | 26    | distance to the target                          | 2 m      | 0    | 3   |
    | 27-28 | cosine, sine of the target's bearing            | 1        | -1   | 1   |
    | 29    | steps left of `max_steps`                       | 1        | 0    | 1   |

    ## Reward

    The terms and weights are those of `MoveToTargetEnv`; `info["reward_terms"]` has each term. For
    `proximity`, the distance is measured from the robot's outline to the nearest scanned point.

    ## Start

    Only the seed of `reset(seed=s)` decides the start, the target and the heading. Start and target are drawn
    uniformly from the free positions of the scene's layout, at least 1 m apart. At a free position the robot
    has 0.1 m of free space around it. The heading is drawn from all directions. `options={"start": (x, y,
    heading), "target": (x, y)}` sets the start, the target or both.

    ## End of an episode

    An episode is terminated when the robot is within 0.15 m of the target (`info["is_success"]`), or when an
    object is nearer than 0.05 m to the outline of the robot. After `max_steps` steps, the option `time_up`
    decides between terminated and truncated, as in `MoveToTargetEnv`.

    ## Info

    `is_success`, `outcome` (running, reached, collided, time_up), `reward_terms` (by name, weighted),
    `extra_steps` (control periods that the step waited for a late sensor).

    Args:
        robot: the robot to drive, with the capabilities in `needs`.
        scene: the scene, which places robot and mark for each episode.
        options: the options for actions and rewards.
        on_close: a function that `close` calls.

    Raises:
        MissingCapability: the robot lacks a capability.
        NoSuchSensor: the connected robot does not have the scanner.
    """

    needs: ClassVar[tuple[type, ...]] = (RobotAbc, Steering, Scanner, Localization)

    def __init__(
        self,
        robot: Any,
        scene: Scene,
        options: NavigateOptions | None = None,
        on_close: Callable[[], None] | None = None,
    ) -> None:
        require(robot, self.needs, type(self).__name__)
        self.options = options or NavigateOptions()
        low = [0.0] * SECTORS + [-1.5, -1.5, 0.0, -1.0, -1.0, 0.0]
        high = [1.0] * SECTORS + [1.5, 1.5, 3.0, 1.0, 1.0, 1.0]
        self._bounds = np.array(low, np.float32), np.array(high, np.float32)
        self.observation_space = spaces.Box(*self._bounds, dtype=np.float32)
        self.action_space = (
            spaces.Box(-1.0, 1.0, (2,), np.float32)
            if self.options.actions == "continuous"
            else spaces.Discrete(len(MOVES))
        )
        # These four attributes are the same robot, because Python has no type for a class with several
        # capabilities.
        self._robot: RobotAbc = robot
        self._wheels: Steering = robot
        self._scanner: Scanner = robot
        self._place: Localization = robot
        self._scene = scene
        self._on_close = on_close
        self._target: Point | None = None
        self._steps = 0
        self._scanner.use_scanner()

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Observation, Info]:
        """Begin the episode that `seed` decides; return its first observation and info.

        Raises:
            ConfigurationError: `options` sets an impossible start or target.
            SimulatorFault: the simulator of the robot failed.
        """
        super().reset(seed=seed)
        self._scene.begin(int(self.np_random.integers(2**31)))
        places = FreePlaces(layout=self._scene.layout(), radius_m=self._wheels.radius_m)
        task = places.chosen_task(self.np_random, options or {})
        self._scene.place(task.start, task.target)
        self._target, self._steps = task.target, 0
        info = {"start": task.start, "target": task.target}
        return self._observe(self._place.pose(), 0.0, 0.0), info

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, Info]:
        """Drive with the velocity of `action` for one control period; return the result of the step.

        Raises:
            ResetNeeded: no episode has begun.
            SimulatorFault: the simulator of the robot failed.
        """
        before = self._place.pose()
        before_m = math.hypot(*self._ahead(before))
        forward, turn = self._shares(action)
        self._wheels.steer(forward * self._wheels.speed_m_s, turn * self._wheels.turn_rad_s)
        extra_steps = self._robot.advance()
        self._steps += 1
        after = self._place.pose()
        nearest_m = float(self._scanner.scan().min()) - self._wheels.radius_m
        after_m = math.hypot(*self._ahead(after))
        outcome = self._outcome(after_m, nearest_m)
        step = Transition(before_m=before_m, after_m=after_m, nearest_m=nearest_m, outcome=outcome)
        moved = velocity(before, after, self._robot.period_s * (1 + extra_steps))
        seen = self._observe(after, moved[0], moved[2])
        return seen, *result(step, self.options, extra_steps)

    def close(self) -> None:
        """Release the simulator if it is one of PALAESTRA_CONFIG; further calls have no effect."""
        if self._on_close is not None:
            self._on_close()

    def _shares(self, action: Any) -> Point:
        if self.options.actions == "continuous":
            forward, turn = np.clip(action, -1.0, 1.0).tolist()
            return forward, turn
        return MOVES[int(action)]

    def _ahead(self, pose: Pose) -> Point:
        """Return the target in the robot's frame: meters forward, meters to the left."""
        if self._target is None:
            raise ResetNeeded("no episode has begun; call reset() first")
        return in_frame(pose.heading_rad, self._target[0] - pose.x_m, self._target[1] - pose.y_m)

    def _outcome(self, target_m: float, nearest_m: float) -> EpisodeOutcome:
        if target_m < REACHED_M:
            return EpisodeOutcome.REACHED
        if nearest_m < BUMPED_M:
            return EpisodeOutcome.COLLIDED
        return EpisodeOutcome.TIME_UP if self._steps >= self.options.max_steps else EpisodeOutcome.RUNNING

    def _observe(self, pose: Pose, forward: float, turning: float) -> Observation:
        nearest = [part.min() for part in np.array_split(self._scanner.scan(), SECTORS)]
        ahead_m, left_m = self._ahead(pose)
        target_m = max(math.hypot(ahead_m, left_m), 1e-9)
        numbers = [
            *((SEEN_M - distance_m) / SEEN_M for distance_m in nearest),
            forward / self._wheels.speed_m_s,
            turning / self._wheels.turn_rad_s,
            target_m / TARGET_M,
            ahead_m / target_m,
            left_m / target_m,
            1.0 - self._steps / self.options.max_steps,
        ]
        low, high = self._bounds
        seen: Observation = np.minimum(np.maximum(np.array(numbers, np.float32), low), high)
        return seen
