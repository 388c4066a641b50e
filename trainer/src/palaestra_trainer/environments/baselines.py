"""Baselines: policies without learning that a trained policy must beat.

Each baseline is a function of the environment, not of the observation, so it works with every choice of
observation parts. `make bench` prints the success rates of the baselines next to that of the trained policy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from palaestra_trainer.environments.actions import nearest
from palaestra_trainer.environments.move_to_target import REACHED_M, MoveToTargetEnv
from palaestra_trainer.robots.geometry import SPEED_M_S

NEAR_M = 0.5 * REACHED_M  # the distance at which `straight_to_target` stops

Policy = Callable[[MoveToTargetEnv], Any]


def random_movement(env: MoveToTargetEnv) -> Any:
    """Return a random action; all actions are equally likely."""
    return env.action_space.sample()


def straight_to_target(env: MoveToTargetEnv) -> Any:
    """Return the action that drives most directly to the target; near the target, return a stop.

    This policy uses no sensor, so a cylinder in its way ends the episode.
    """
    forward_m, left_m = env.situation.target_ahead
    distance_m = math.hypot(forward_m, left_m)
    if distance_m < NEAR_M:
        return nearest((0.0, 0.0, 0.0), env.options)
    pace = SPEED_M_S / distance_m
    return nearest((forward_m * pace, left_m * pace, 0.0), env.options)


BASELINES: dict[str, Policy] = {
    "random": random_movement,
    "straight_to_target": straight_to_target,
}


def success_rate(env: MoveToTargetEnv, policy: Policy, seeds: Iterable[int]) -> float:
    """Return the share of episodes, one per seed, in which the policy stops on the target."""
    successes = [_succeeds(env, policy, seed) for seed in seeds]
    return sum(successes) / len(successes)


def _succeeds(env: MoveToTargetEnv, policy: Policy, seed: int) -> bool:
    env.reset(seed=seed)
    env.action_space.seed(seed)
    while True:
        _, _, terminated, truncated, info = env.step(policy(env))
        if terminated or truncated:
            return bool(info["is_success"])
