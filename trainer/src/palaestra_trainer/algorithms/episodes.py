"""Collect whole episodes from the rows of vector steps, with their returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palaestra_trainer.algorithms.observations import Observations, part, stacked


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """The steps of some whole episodes, one after the other.

    Attributes:
        observations: the observation before each step, shape (steps, *observation); for a Dict, an array for
            each key.
        actions: the action of each step, not clipped to the bounds of the space; shape (steps, *action).
        returns: for each step, the discounted sum of the rewards until the end of its episode; shape
            (steps,), float32.
    """

    observations: Observations
    actions: np.ndarray
    returns: np.ndarray


@dataclass(slots=True)
class _Episode:
    observations: list[Any] = field(default_factory=list)
    actions: list[Any] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)


class EpisodeRecorder:
    """Collects up to `wanted` whole valid episodes of each of `environments` environments.

    When an environment has `wanted` episodes, its further episodes are dropped. Episodes with an invalid row
    are dropped too. An environment whose last row was invalid counts as absent. The update does not wait for
    an absent environment, because its simulator may never return.
    """

    def __init__(self, environments: int, wanted: int) -> None:
        self._wanted = wanted
        self._current = [_Episode() for _ in range(environments)]
        self._whole: list[list[_Episode]] = [[] for _ in range(environments)]
        self._away = [False] * environments

    @property
    def complete(self) -> bool:
        """Whether every environment that is not absent has `wanted` episodes."""
        ready = [len(episodes) == self._wanted for episodes in self._whole]
        return any(ready) and all(done or away for done, away in zip(ready, self._away, strict=True))

    @property
    def longest(self) -> int:
        """The number of steps of the longest open episode."""
        return max(len(episode.rewards) for episode in self._current)

    def add(
        self,
        observations: Any,
        actions: np.ndarray,
        rewards: np.ndarray,
        dones: np.ndarray,
        valid: np.ndarray,
    ) -> None:
        """Add one vector step; each array has one row per environment."""
        for index, (episode, whole) in enumerate(zip(self._current, self._whole, strict=True)):
            self._away[index] = not valid[index]
            if self._away[index]:
                self._current[index] = _Episode()
            if self._away[index] or len(whole) == self._wanted:
                continue
            episode.observations.append(part(observations, index))
            episode.actions.append(actions[index])
            episode.rewards.append(float(rewards[index]))
            if dones[index]:
                whole.append(episode)
                self._current[index] = _Episode()

    def batch(self, gamma: float) -> Batch:
        """Return the whole episodes, environment by environment, with returns discounted by gamma."""
        episodes = [episode for whole in self._whole for episode in whole]
        steps = [returns_to_go(episode.rewards, gamma) for episode in episodes]
        return Batch(
            observations=stacked([seen for episode in episodes for seen in episode.observations]),
            actions=np.array([done for episode in episodes for done in episode.actions]),
            returns=np.concatenate(steps) if steps else np.zeros(0, dtype=np.float32),
        )


def returns_to_go(rewards: list[float], gamma: float) -> np.ndarray:
    """Return, for each step, the discounted sum of its reward and all later rewards, float32."""
    returns = np.zeros(len(rewards), dtype=np.float32)
    later = 0.0
    for step in range(len(rewards) - 1, -1, -1):
        later = rewards[step] + gamma * later
        returns[step] = later
    return returns
