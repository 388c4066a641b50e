"""The task to drive to the target and stay there, with the goal in the observation.

The task is for algorithms that also learn from goals that the policy reached by accident, such as hindsight
experience replay. The interface is that of gymnasium-robotics: a Dict with `achieved_goal` and
`desired_goal`, and rewards that are a function of these two goals. An inner `MoveToTargetEnv` plays the
episodes, so this task has the same robot, scene and faults.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from palaestra_trainer.environments.infos import OURS
from palaestra_trainer.environments.move_to_target import REACHED_M, MoveToTargetEnv
from palaestra_trainer.environments.observation import UNIT_M
from palaestra_trainer.environments.options import GoalOptions, time_up_terminates
from palaestra_trainer.environments.rewards import EpisodeOutcome
from palaestra_trainer.robots.base import RobotinoAbc, Scene

Numbers = NDArray[np.float32]
Observation = dict[str, Numbers]
Info = dict[str, Any]

FARTHEST_M = 2.0 * math.sqrt(2.0) * UNIT_M  # the distance between opposite corners of the floor


class MoveToTargetGoalEnv(gymnasium.Env[Observation, Any]):
    """Drive to the target and stay there, within 0.20 m, until time is up.

    Robot, floor, start, target and actions are those of `MoveToTargetEnv`.

    ## Observation

    The space is a `Dict`. The key `observation` has by default the parts sensors, velocity, position and
    time_left; the tables of `MoveToTargetEnv` describe their numbers. The part `target` is refused.

    | key           | index | meaning                                      | unit | min | max |
    |---------------|-------|----------------------------------------------|------|-----|-----|
    | observation   | 0-17  | the parts named by `observe`                 |      |     |     |
    | achieved_goal | 0-1   | x, y of the robot in the world's frame       | m    | -2  | 2   |
    | desired_goal  | 0-1   | x, y of the target in the world's frame      | m    | -2  | 2   |

    ## Reward

    `compute_reward(achieved_goal, desired_goal, info)` returns the reward of one pair of goals or of many
    pairs. It does not use `info`. The term `reached` in `info["reward_terms"]` holds the reward.

    | reward | min | max | is                                                            |
    |--------|-----|-----|---------------------------------------------------------------|
    | Sparse | 0   | 1   | 1 within 0.20 m of the desired goal                           |
    | Dense  | 0   | 1   | 1 at the desired goal, falling linearly to 0 at 5.66 m         |

    Rewards are never negative, unlike in gymnasium-robotics. A collision ends the episode, and with negative
    rewards an early end would be worth more than further steps.

    ## Start

    An episode starts as in `MoveToTargetEnv`, with the same seeds and options.

    ## End of an episode

    An episode is terminated when the robot bumps into something (`compute_terminated`). The episode continues
    after the robot reaches the target, so the value of a goal does not depend on whether the goal was desired
    or only achieved. After `max_steps` steps the episode is truncated (`compute_truncated`), or terminated
    with `time_up="terminated"`.

    ## Info

    `is_success`: whether the robot is within 0.20 m of the target. An episode succeeds if its last step does.
    `outcome` (running, reached, collided, time_up), `reward_terms`, `extra_steps`.

    Args:
        robot: the robot to drive.
        scene: the scene, which places robot and mark for each episode.
        options: the options for observation, actions and rewards.
        on_close: a function that `close` calls.
    """

    needs: ClassVar[tuple[type, ...]] = MoveToTargetEnv.needs

    def __init__(
        self,
        robot: RobotinoAbc,
        scene: Scene,
        options: GoalOptions | None = None,
        on_close: Callable[[], None] | None = None,
    ) -> None:
        self.options = options or GoalOptions()
        self._drive = MoveToTargetEnv(robot, scene, self.options, on_close)
        self.action_space = self._drive.action_space
        place = spaces.Box(-UNIT_M, UNIT_M, (2,), np.float32)
        self.observation_space = spaces.Dict(
            {
                "observation": self._drive.observation_space,
                "achieved_goal": place,
                "desired_goal": spaces.Box(-UNIT_M, UNIT_M, (2,), np.float32),
            }
        )
        self._steps = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Info]:
        """Begin an episode; see `MoveToTargetEnv.reset`."""
        super().reset(seed=seed)
        numbers, info = self._drive.reset(seed=seed, options=options)
        self._steps = 0
        return self._seen(numbers), info

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, Info]:
        """Drive with the velocity of `action` for one control period; return the result of the step.

        Raises:
            ResetNeeded: no episode has begun.
            SimulatorFault: the simulator of the robot failed.
        """
        numbers, _, _, _, driven = self._drive.step(action)
        self._steps += 1
        seen = self._seen(numbers)
        achieved, desired = seen["achieved_goal"], seen["desired_goal"]
        reached = bool(_distance_m(achieved, desired) < REACHED_M)
        info = {
            "is_success": reached,
            "outcome": self._outcome(reached=reached).value,
            OURS: driven[OURS],
        }
        reward = float(self.compute_reward(achieved, desired, info))
        info["reward_terms"] = {"reached": reward}
        terminated = self.compute_terminated(achieved, desired, info)
        return seen, reward, terminated, self.compute_truncated(achieved, desired, info), info

    def compute_reward(self, achieved_goal: Numbers, desired_goal: Numbers, info: Any) -> Numbers:
        """Return the reward of each pair of goals, with shape (...) for goals of shape (..., 2)."""
        del info
        distance_m = _distance_m(achieved_goal, desired_goal)
        if self.options.reward == "Sparse":
            return np.asarray(distance_m < REACHED_M, np.float32)
        return np.asarray(1.0 - distance_m / FARTHEST_M, np.float32)

    def compute_terminated(
        self, achieved_goal: Numbers, desired_goal: Numbers, info: Mapping[str, Any]
    ) -> bool:
        """Return whether a step with this info terminates the episode."""
        del achieved_goal, desired_goal
        time_up = self._is_time_up(info) and time_up_terminates(self.options)
        return info["outcome"] == EpisodeOutcome.COLLIDED.value or time_up

    def compute_truncated(
        self, achieved_goal: Numbers, desired_goal: Numbers, info: Mapping[str, Any]
    ) -> bool:
        """Return whether a step with this info truncates the episode, because time is up."""
        del achieved_goal, desired_goal
        return self._is_time_up(info) and not time_up_terminates(self.options)

    def close(self) -> None:
        """Release the simulator if it is one of PALAESTRA_CONFIG; further calls have no effect."""
        self._drive.close()

    def _outcome(self, *, reached: bool) -> EpisodeOutcome:
        if self._drive.situation.bumped:
            return EpisodeOutcome.COLLIDED
        if self._steps < self.options.max_steps:
            return EpisodeOutcome.RUNNING
        return EpisodeOutcome.REACHED if reached else EpisodeOutcome.TIME_UP

    def _is_time_up(self, info: Mapping[str, Any]) -> bool:
        return info["outcome"] in {EpisodeOutcome.REACHED.value, EpisodeOutcome.TIME_UP.value}

    def _seen(self, numbers: Numbers) -> Observation:
        now = self._drive.situation
        return {
            "observation": numbers,
            "achieved_goal": _place(now.pose.x_m, now.pose.y_m),
            "desired_goal": _place(*now.target),
        }


def _place(x_m: float, y_m: float) -> Numbers:
    return np.clip(np.array((x_m, y_m), np.float32), -UNIT_M, UNIT_M)


def _distance_m(one: Numbers, other: Numbers) -> Any:
    return np.linalg.norm(np.asarray(one) - np.asarray(other), axis=-1)
