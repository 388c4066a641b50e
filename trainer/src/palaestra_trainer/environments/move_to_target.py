"""The task to drive to the target and stand there.

The environment consists of a robot and a scene, and depends on neither ROS nor Webots. It defines the
observations, the rewards and the end of an episode. It does not catch a `SimulatorFault` of the robot. The
caller of `step` decides how learning treats the fault.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from palaestra_trainer.environments import observation
from palaestra_trainer.environments.actions import action_space, twist
from palaestra_trainer.environments.observation import StepState
from palaestra_trainer.environments.options import MoveToTargetOptions
from palaestra_trainer.environments.placement import FreePlaces
from palaestra_trainer.environments.rewards import EpisodeOutcome, Transition
from palaestra_trainer.environments.step_result import result
from palaestra_trainer.robots.base import RobotinoAbc, Scene
from palaestra_trainer.robots.capabilities import require
from palaestra_trainer.robots.geometry import Point, Twist

REACHED_M = 0.20
STANDING_M_S = 0.05

Observation = NDArray[np.float32]
Info = dict[str, Any]


class MoveToTargetEnv(gymnasium.Env[Observation, Any]):
    """Drive to the target and stand there: within 0.20 m, slower than 0.05 m/s.

    A Robotino drives on a walled floor of 4 x 4 m with four cylinders; start, heading and target differ in
    every episode. A step is one control period of the robot (0.192 s in simulation). At 0.5 m/s the robot
    drives 0.1 m in a step, and after STOP it stands within two steps.

    ## Actions

    With `actions="discrete"`, the space is `Discrete(n)` for the `movements` in their order, by default all
    of this table. The example move-to-target.yaml chooses the first five, with which a policy learns faster:

    | action | movement   | forward (m/s) | left (m/s) | turning (rad/s) |
    |--------|------------|---------------|------------|-----------------|
    | 0      | STOP       | 0             | 0          | 0               |
    | 1      | FORWARD    | 0.5           | 0          | 0               |
    | 2      | BACKWARD   | -0.5          | 0          | 0               |
    | 3      | LEFT       | 0             | 0.5        | 0               |
    | 4      | RIGHT      | 0             | -0.5       | 0               |
    | 5      | TURN_LEFT  | 0             | 0          | 1               |
    | 6      | TURN_RIGHT | 0             | 0          | -1              |

    `actions="continuous"`: `Box(-1, 1, (3,), float32)`

    | index | meaning                      | unit      | min | max |
    |-------|------------------------------|-----------|-----|-----|
    | 0     | velocity forward             | 0.5 m/s   | -1  | 1   |
    | 1     | velocity to the left         | 0.5 m/s   | -1  | 1   |
    | 2     | turning counter-clockwise    | 1.0 rad/s | -1  | 1   |

    ## Observation

    The space is a `Box(float32)` with the parts that `observe` names, one after the other. Each number is
    clipped to its bounds. The index counts within a part. Sensor 0 points forward, and the other sensors
    follow counter-clockwise every 40 degrees.

    | part      | index | meaning                                       | unit      | min  | max |
    |-----------|-------|-----------------------------------------------|-----------|------|-----|
    | sensors   | 0-8   | nearness of the nearest object within 0.40 m  | 0.37 m    | 0    | 1   |
    | sensors   | 9     | the bumper touches something                  | 0 or 1    | 0    | 1   |
    | velocity  | 0     | forward, mean over the step                   | 0.5 m/s   | -1.5 | 1.5 |
    | velocity  | 1     | to the left, mean over the step               | 0.5 m/s   | -1.5 | 1.5 |
    | velocity  | 2     | turning, mean over the step                   | 1.0 rad/s | -1.5 | 1.5 |
    | position  | 0-1   | x, y in the world's frame                     | 2 m       | -1   | 1   |
    | position  | 2-3   | cosine, sine of the heading                   | 1         | -1   | 1   |
    | target    | 0-1   | forward, left from the robot                  | 2 m       | -3   | 3   |
    | time_left | 0     | steps left of `max_steps`                     | 1         | 0    | 1   |
    | to_reach  | 0     | targets left; always 1 with a single target   | 1         | 0    | 1   |

    By default `observe` names all parts except `position` and `to_reach`; docs/explain/tasks.md describes the
    benefit and the cost of each part.

    ## Reward

    The reward is a weighted sum of the terms in `palaestra_trainer.environments.rewards`;
    `info["reward_terms"]` has each term.

    | term      | Dense | Sparse | min  | max | is                                                  |
    |-----------|-------|--------|------|-----|-----------------------------------------------------|
    | progress  | 1     |        | -0.1 | 0.1 | meters gained toward the target, by one movement    |
    | success   | 1     | 1      | 0    | 1   | 1 when the robot came to stand on it                |
    | collision | -1    | -1     | 0    | 1   | 1 when it ran into something                        |
    | proximity | -0.1  |        | 0    | 1   | rises linearly as objects come from 0.18 to 0.03 m  |
    | time_up   |       | -0.5   | 0    | 1   | 1 when time is up without success or collision      |
    | duration  | -0.01 |        | 1    | 1   | 1 for every step                                    |

    ## Start

    Only the seed of `reset(seed=s)` decides the start, the target and the heading. Start and target are drawn
    uniformly from the free positions, at least 1 m apart. At a free position the robot has 0.1 m of free
    space around it. The heading is drawn from all directions. `options={"start": (x, y, heading), "target":
    (x, y)}` sets the start, the target or both.

    ## End of an episode

    An episode is terminated when the robot stands on the target (`info["is_success"]`) or bumps into an
    object. After `max_steps` steps, the option `time_up` decides. With `"truncated"` (the default for Dense)
    a learner estimates the value of later steps. With `"terminated"` (the default for Sparse) a learner
    counts later steps as worth 0.

    ## Info

    `is_success`, `outcome` (running, reached, collided, time_up), `reward_terms` (by name, weighted),
    `extra_steps` (control periods that the step waited for a late sensor).

    `render()` raises NotImplementedError. `close()` does not end a simulator of PALAESTRA_CONFIG, so another
    environment can use it afterwards. `close()` ends a stub that `gymnasium.make` started for this
    environment.

    Args:
        robot: the robot to drive.
        scene: the scene, which places robot and mark for each episode.
        options: the options for observation, actions and rewards.
        on_close: a function that `close` calls.

    Raises:
        MissingCapability: the robot is not a Robotino.
    """

    needs: ClassVar[tuple[type, ...]] = (RobotinoAbc,)
    reached_m: ClassVar[float] = REACHED_M  # a subclass may ask for a smaller distance to the target

    def __init__(
        self,
        robot: RobotinoAbc,
        scene: Scene,
        options: MoveToTargetOptions | None = None,
        on_close: Callable[[], None] | None = None,
    ) -> None:
        require(robot, self.needs, type(self).__name__)
        self.options = options or MoveToTargetOptions()
        self.observation_space = self._numbers = observation.space(self.options.observe)
        self.action_space = action_space(self.options)
        self._robot = robot
        self._scene = scene
        self._on_close = on_close
        self._situation: StepState | None = None
        self._targets: list[Point] = []
        self._at = 0  # index of the current target
        self._steps = 0

    @property
    def situation(self) -> StepState:
        """The current complete state, including values that are not in the observation.

        Raises:
            ResetNeeded: no episode has begun.
        """
        if self._situation is None:
            raise ResetNeeded("no episode has begun; call reset() first")
        return self._situation

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Info]:
        """Begin an episode; return its first observation, and an info that holds start and target.

        Args:
            seed: decides the episode; None: the random generator continues from the last seed.
            options: `start` (x, y, heading) and `target` (x, y), in meters and radians.

        Raises:
            ConfigurationError: an option is unknown, or names a position in an obstacle.
            SimulatorFault: the simulator of the robot failed.
        """
        super().reset(seed=seed)
        self._scene.begin(int(self.np_random.integers(2**31)))
        places = FreePlaces(layout=self._scene.layout(), radius_m=self._robot.radius_m)
        task = places.chosen_task(self.np_random, options or {})
        self._scene.place(task.start, task.target)
        self._targets = [task.target, *self._more_targets(places, task.target)]
        self._at = 0
        self._steps = 0
        self._situation = seen = self._look((0.0, 0.0, 0.0))
        return self._numbers_of(seen), {"start": task.start, "target": task.target}

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, Info]:
        """Drive with the velocity of `action` for one control period; return the result of the step.

        Raises:
            ResetNeeded: no episode has begun.
            SimulatorFault: the simulator of the robot failed.
        """
        before = self.situation
        self._robot.drive(*twist(action, self.options))
        extra_steps = self._robot.advance()
        self._steps += 1
        elapsed_s = self._robot.period_s * (1 + extra_steps)
        after = self._look(observation.velocity(before.pose, self._robot.pose(), elapsed_s))
        self._situation = after
        outcome = self._outcome(after)
        step = _transition(before, after, outcome)
        if outcome is EpisodeOutcome.DELIVERED:
            self._situation = after = self._next_target(after)
        return self._numbers_of(after), *result(step, self.options, extra_steps)

    def close(self) -> None:
        """Release the simulator if it is one of PALAESTRA_CONFIG; further calls have no effect."""
        if self._on_close is not None:
            self._on_close()

    def _look(self, velocity: Twist) -> StepState:
        return StepState(
            distances_m=self._robot.distances(),
            bumped=self._robot.bumped(),
            pose=self._robot.pose(),
            velocity=velocity,
            target=self._targets[self._at],
            time_left=1.0 - self._steps / self.options.max_steps,
            to_reach=1.0 - self._at / len(self._targets),
        )

    def _outcome(self, seen: StepState) -> EpisodeOutcome:
        if seen.bumped:
            return EpisodeOutcome.COLLIDED
        if seen.target_distance_m < self.reached_m and seen.speed_m_s < STANDING_M_S:
            return EpisodeOutcome.REACHED if self._at == len(self._targets) - 1 else EpisodeOutcome.DELIVERED
        return EpisodeOutcome.TIME_UP if self._steps >= self.options.max_steps else EpisodeOutcome.RUNNING

    def _more_targets(self, places: FreePlaces, first: Point) -> Iterable[Point]:
        """Return the targets after the first target; here none, but a subclass may return some."""
        del places, first
        return ()

    def _next_target(self, seen: StepState) -> StepState:
        """Move the mark to the next target; return the state with that target."""
        self._at += 1
        target = self._targets[self._at]
        self._scene.mark(target)
        return replace(seen, target=target, to_reach=1.0 - self._at / len(self._targets))

    def _numbers_of(self, seen: StepState) -> Observation:
        return observation.observe(seen, self.options.observe, self._numbers)


def _transition(before: StepState, after: StepState, outcome: EpisodeOutcome) -> Transition:
    return Transition(
        before_m=before.target_distance_m,
        after_m=after.target_distance_m,
        nearest_m=min(after.distances_m.tolist()),
        outcome=outcome,
    )
