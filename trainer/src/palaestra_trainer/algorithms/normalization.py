"""Observations and rewards on one scale: Stable-Baselines3's VecNormalize, which learns from valid rows only.

Observations are shifted and scaled by their running mean and deviation, rewards scaled by the deviation of
the discounted return. What a fault spoiled reaches no statistic, as it reaches no loss. What is known so far
is part of a policy: without it the policy cannot be used, so it is kept in the file of the model. Why so:
docs/decisions/0010-normalize.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecEnv, VecNormalize
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from palaestra_trainer.algorithms.buffers import valid_rows
from palaestra_trainer.configuration import Normalize


@dataclass(frozen=True, slots=True)
class Moments:
    """Mean and variance of what was seen so far, and how often it was seen; nobody writes to the arrays."""

    mean: np.ndarray
    variance: np.ndarray
    count: float

    @classmethod
    def of(cls, running: RunningMeanStd) -> Self:
        """Return those of Stable-Baselines3's statistics, which go on in new arrays."""
        return cls(running.mean, running.var, running.count)

    def put_back(self, running: RunningMeanStd) -> None:
        """Let the statistics go on from here."""
        running.mean, running.var, running.count = self.mean, self.variance, self.count

    def to_json(self) -> dict[str, Any]:
        """Return them as JSON data, exactly."""
        return {
            "mean": np.asarray(self.mean).tolist(),
            "variance": np.asarray(self.variance).tolist(),
            "count": self.count,
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any], shape: tuple[int, ...]) -> Self:
        """Return what `to_json` wrote.

        Raises:
            KeyError, TypeError, ValueError: it did not write that, or of another shape.
        """
        mean, variance = (np.array(content[name], dtype=np.float64) for name in ("mean", "variance"))
        if mean.shape != shape or variance.shape != shape:
            raise ValueError(f"statistics of shape {mean.shape}, not {shape}")
        return cls(mean, variance, float(content["count"]))


class ValidNormalize(VecNormalize):
    """VecNormalize of rows of which some may be invalid.

    Args:
        venv: tells by `info["valid"]` False which rows of a step, or of a reset, are invalid.
        wanted: what is normalized, and where it is clipped.
        gamma: discount of the return that rewards are scaled by.
    """

    venv: VecEnv
    obs_rms: RunningMeanStd  # type: ignore[assignment]  # one Box is observed: make_model takes nothing else

    def __init__(self, venv: VecEnv, wanted: Normalize, gamma: float) -> None:
        super().__init__(
            venv,
            norm_obs=wanted.observations,
            norm_reward=wanted.rewards,
            clip_obs=wanted.clip_observations,
            clip_reward=wanted.clip_rewards,
            gamma=gamma,
        )

    @property
    def scales(self) -> Mapping[str, Moments]:
        """What is known of observations and rewards, of each only if it is normalized; set it to go back."""
        return {name: Moments.of(running) for name, running in self._running().items()}

    @scales.setter
    def scales(self, scales: Mapping[str, Moments]) -> None:
        for name, running in self._running().items():
            scales[name].put_back(running)

    def reset(self) -> np.ndarray:
        """Return the first observations of new episodes, normalized."""
        observations = np.asarray(self.venv.reset())
        self.old_obs = observations
        self.returns = np.zeros(self.num_envs)
        self._see(observations[valid_rows(self.unwrapped.reset_infos)])
        return self._normalized(observations)

    def step_wait(self) -> VecEnvStepReturn:
        """Return a step's rows, normalized with what is known after it; the valid ones become known by it."""
        rows, rewards, dones, infos = self.venv.step_wait()
        observations, valid = np.asarray(rows), valid_rows(infos)
        self.old_obs, self.old_reward = observations, rewards
        # Where no episode could begin, what is shown is the end of the last one.
        blind = dones & ~valid_rows(self.unwrapped.reset_infos)
        self._see(observations[valid & ~blind])
        self._earn(rewards, valid)
        self.returns = np.where(dones, 0.0, self.returns)
        for info in infos:
            if "terminal_observation" in info:
                info["terminal_observation"] = self._normalized(info["terminal_observation"])
        return self._normalized(observations), self.normalize_reward(rewards), dones, infos

    def go_on(self, observations: np.ndarray, returns: np.ndarray) -> np.ndarray:
        """Return the observations, normalized, after going back to where they were the last ones.

        `returns` are the discounted rewards of the episodes then, one a member.
        """
        self.old_obs, self.returns = observations, returns
        return self._normalized(observations)

    def to_json(self) -> dict[str, Any]:
        """Return what a policy needs to know of it, and training to go on, as JSON data."""
        clips = self._clips()
        scales = {name: moments.to_json() | {"clip": clips[name]} for name, moments in self.scales.items()}
        return scales | {"epsilon": self.epsilon}

    def learn_from_json(self, content: Mapping[str, Any]) -> None:
        """Know what another one knew that wrote it by `to_json`, and was to normalize the same.

        Raises:
            KeyError, TypeError, ValueError: it was not written so.
        """
        running, there = self._running(), sorted(content.keys() - {"epsilon"})
        if there != sorted(running):
            raise ValueError(f"it normalizes {' and '.join(there)}")
        if content["epsilon"] != self.epsilon:
            raise ValueError(f"its epsilon is {content['epsilon']}")
        if any(content[name]["clip"] != clip for name, clip in self._clips().items()):
            raise ValueError("it clips elsewhere")
        self.scales = {name: Moments.from_json(content[name], np.shape(running[name].mean)) for name in there}

    def _running(self) -> dict[str, RunningMeanStd]:
        observations = {"observations": self.obs_rms} if self.norm_obs else {}
        return observations | ({"rewards": self.ret_rms} if self.norm_reward else {})

    def _clips(self) -> dict[str, float]:
        clips = {"observations": self.clip_obs, "rewards": self.clip_reward}
        return {name: clips[name] for name in self._running()}

    def _see(self, observations: np.ndarray) -> None:
        if self.norm_obs and len(observations):
            self.obs_rms.update(observations)

    def _earn(self, rewards: np.ndarray, valid: np.ndarray) -> None:
        self.returns = self.returns * self.gamma + rewards
        if self.norm_reward and valid.any():
            self.ret_rms.update(self.returns[valid])

    def _normalized(self, observations: np.ndarray) -> np.ndarray:
        return np.asarray(self.normalize_obs(observations))


class Normalized:
    """A policy for observations as they are: it sees them as it saw them when it learned."""

    def __init__(self, model: BaseAlgorithm, normalizer: ValidNormalize) -> None:
        self._model = model
        self._normalizer = normalizer

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,  # noqa: FBT001, FBT002 - as in Stable-Baselines3
    ) -> tuple[Any, Any]:
        """Return an action for one observation, and the policy's next state."""
        seen = self._normalizer.normalize_obs(observation)
        return self._model.predict(seen, state, episode_start, deterministic)


def normalizer_of(model: BaseAlgorithm) -> ValidNormalize | None:
    """Return what normalizes a model's observations and rewards; None: nothing does."""
    found = model.get_vec_normalize_env()
    return found if isinstance(found, ValidNormalize) else None


def policy_of(model: BaseAlgorithm) -> BaseAlgorithm | Normalized:
    """Return the policy of a model, for observations as they are; what it knows of them is not changed."""
    normalizer = normalizer_of(model)
    return Normalized(model, normalizer) if normalizer else model
