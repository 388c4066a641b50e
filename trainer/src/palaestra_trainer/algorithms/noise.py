"""Noise on actions, set by the hyperparameters `noise_type` and `noise_std` of rl-baselines3-zoo.

Each member has its own noise process, which restarts with each episode.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.noise import (
    ActionNoise,
    NormalActionNoise,
    OrnsteinUhlenbeckActionNoise,
    VectorizedActionNoise,
)
from stable_baselines3.common.vec_env import VecEnv

from palaestra_trainer.job.configuration import nearest

KINDS: Mapping[str, type[NormalActionNoise | OrnsteinUhlenbeckActionNoise]] = {
    "normal": NormalActionNoise,
    "ornstein-uhlenbeck": OrnsteinUhlenbeckActionNoise,
}
NAMES = ("noise_type", "noise_std")


def mistakes(given: Mapping[str, Any], field: str) -> Iterator[str]:
    """Yield a message with field, fact and remedy for each wrong value of `noise_type` or `noise_std`."""
    kind, deviation = given.get("noise_type"), given.get("noise_std")
    if kind is not None and kind not in KINDS:
        yield f"{field}.noise_type: {kind!r} is not known; {nearest(str(kind), dict(KINDS))}"
    if deviation is not None and not _is_positive(deviation):
        yield f"{field}.noise_std: {deviation!r} is refused; give a number above 0"
    if (kind is None) != (deviation is None):
        missing = "noise_std" if deviation is None else "noise_type"
        yield f"{field}.{missing}: is missing; noise has a type and a deviation, set both or neither"


def action_noise(given: Mapping[str, Any], env: VecEnv) -> ActionNoise | None:
    """Return the noise of a model in `env`; None if the job sets no type, or if actions are not a Box."""
    kind = given.get("noise_type")
    if kind is None or not isinstance(env.action_space, spaces.Box):
        return None
    mean = np.zeros(env.action_space.shape)
    one = KINDS[kind](mean=mean, sigma=given["noise_std"] * np.ones_like(mean))
    return VectorizedActionNoise(one, env.num_envs) if env.num_envs > 1 else one


def positions(noise: ActionNoise | None) -> np.ndarray | None:
    """Return the states of the members' noise, shape (members, *action); None for noise without state."""
    processes = _processes(noise)
    return np.stack([process.noise_prev for process in processes]) if processes else None


def put_back(noise: ActionNoise | None, before: np.ndarray) -> None:
    """Set the noise processes to the states in `before`; a member without a state there starts at 0."""
    for process, position in zip(_processes(noise), before, strict=False):
        process.noise_prev = position


def _processes(noise: ActionNoise | None) -> list[OrnsteinUhlenbeckActionNoise]:
    members = noise.noises if isinstance(noise, VectorizedActionNoise) else [noise]
    return [member for member in members if isinstance(member, OrnsteinUhlenbeckActionNoise)]


def _is_positive(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and value > 0
