"""Normalize observations and rewards as Stable-Baselines3's VecNormalize does, from valid rows only.

Observations are shifted by their running mean and divided by their running deviation. Rewards are divided by
the running deviation of the discounted return. In a Dict, each Box of numbers has its own statistics. Images
and discrete values are not normalized. Invalid rows affect neither the statistics nor a loss. A policy needs
the statistics of its training, so model.zip contains them. docs/decisions/0010-normalize.md gives the
reasons.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self, cast

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecEnv, VecNormalize
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from palaestra_trainer.algorithms.buffers import valid_rows
from palaestra_trainer.algorithms.observations import Observations, by_name, part
from palaestra_trainer.algorithms.space_compat import scalable
from palaestra_trainer.job.configuration import Normalize


@dataclass(frozen=True, slots=True)
class Moments:
    """Mean, variance and number of the samples so far, in arrays that never change."""

    mean: np.ndarray
    variance: np.ndarray
    count: float

    @classmethod
    def of(cls, running: RunningMeanStd) -> Self:
        """Return the moments of Stable-Baselines3's statistics.

        The arrays are not copied, because an update of the statistics replaces them.
        """
        return cls(running.mean, running.var, running.count)

    def put_back(self, running: RunningMeanStd) -> None:
        """Restore the statistics from these moments."""
        running.mean, running.var, running.count = self.mean, self.variance, self.count

    def to_json(self) -> dict[str, Any]:
        """Return the moments as JSON data, without loss of precision."""
        return {
            "mean": np.asarray(self.mean).tolist(),
            "variance": np.asarray(self.variance).tolist(),
            "count": self.count,
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any], shape: tuple[int, ...]) -> Self:
        """Return the moments from the result of `to_json`.

        Raises:
            KeyError, TypeError, ValueError: `content` is not a result of `to_json`, or has another shape.
        """
        mean, variance = (np.array(content[name], dtype=np.float64) for name in ("mean", "variance"))
        if mean.shape != shape or variance.shape != shape:
            raise ValueError(f"statistics of shape {mean.shape}, not {shape}")
        return cls(mean, variance, float(content["count"]))


class ValidNormalize(VecNormalize):
    """A VecNormalize that ignores invalid rows.

    Args:
        venv: the environment; it marks invalid rows of a step or a reset, see
            `palaestra_trainer.environments.infos`.
        wanted: the values to normalize, and the limits to which these values are clipped.
        gamma: discount of the return whose deviation divides the rewards.
    """

    venv: VecEnv

    def __init__(self, venv: VecEnv, wanted: Normalize, gamma: float) -> None:
        keys = scalable(venv.observation_space) if wanted.observations else None
        super().__init__(
            venv,
            norm_obs=wanted.observations,
            norm_obs_keys=keys if isinstance(keys, list) else None,
            norm_reward=wanted.rewards,
            clip_obs=wanted.clip_observations,
            clip_reward=wanted.clip_rewards,
            gamma=gamma,
        )

    @property
    def scales(self) -> Mapping[str, Moments]:
        """The statistics of the normalized values; set this property to restore them."""
        return {name: Moments.of(running) for name, running in self._running().items()}

    @scales.setter
    def scales(self, scales: Mapping[str, Moments]) -> None:
        for name, running in self._running().items():
            scales[name].put_back(running)

    def reset(self) -> Any:
        """Return the normalized first observations of new episodes."""
        observations = cast("Observations", self.venv.reset())
        self.old_obs = observations
        self.returns = np.zeros(self.num_envs)
        self._see(part(observations, valid_rows(self.unwrapped.reset_infos)))
        return self.normalize_obs(observations)

    def step_wait(self) -> VecEnvStepReturn:
        """Return the normalized rows of a step; its valid rows update the statistics first."""
        rows, rewards, dones, infos = self.venv.step_wait()
        observations, valid = cast("Observations", rows), valid_rows(infos)
        self.old_obs, self.old_reward = observations, rewards
        # If a reset failed, the row still holds the last observation of the previous episode.
        blind = dones & ~valid_rows(self.unwrapped.reset_infos)
        self._see(part(observations, valid & ~blind))
        self._earn(rewards, valid)
        self.returns = np.where(dones, 0.0, self.returns)
        for info in infos:
            if "terminal_observation" in info:
                info["terminal_observation"] = self.normalize_obs(info["terminal_observation"])
        return self.normalize_obs(observations), self.normalize_reward(rewards), dones, infos

    def go_on(self, observations: Observations, returns: np.ndarray) -> Any:
        """Set the last observations and returns of a resumed run; return the normalized observations.

        For each member, `returns` holds the discounted sum of the rewards so far in its open episode.
        """
        self.old_obs, self.returns = observations, returns
        return self.normalize_obs(observations)

    def to_json(self) -> dict[str, Any]:
        """Return the statistics that a policy and further training need, as JSON data."""
        clips = self._clips()
        scales = {name: moments.to_json() | {"clip": clips[name]} for name, moments in self.scales.items()}
        return scales | {"epsilon": self.epsilon}

    def learn_from_json(self, content: Mapping[str, Any]) -> None:
        """Load the statistics that another normalizer with the same settings returned from `to_json`.

        Raises:
            KeyError, TypeError, ValueError: the content is invalid, or its settings are different.
        """
        running, there = self._running(), sorted(content.keys() - {"epsilon"})
        if there != sorted(running):
            raise ValueError(f"it normalizes {' and '.join(there)}")
        if content["epsilon"] != self.epsilon:
            raise ValueError(f"its epsilon is {content['epsilon']}")
        if any(content[name]["clip"] != clip for name, clip in self._clips().items()):
            raise ValueError("its limits of clipping are different")
        self.scales = {name: Moments.from_json(content[name], np.shape(running[name].mean)) for name in there}

    def take_over(self, content: Mapping[str, Any]) -> None:
        """Load some of the statistics that `to_json` wrote; the clip values of this run do not change.

        Raises:
            KeyError, TypeError, ValueError: `content` is not a result of `to_json`, or has another shape.
        """
        running = self._running()
        found = {name: Moments.from_json(content[name], np.shape(running[name].mean)) for name in content}
        self.scales = {**self.scales, **found}

    def _running(self) -> dict[str, RunningMeanStd]:
        """Return the statistics by name: "rewards", and "observations" or "observations/key" for each key."""
        observations = self._seen() if self.norm_obs else {}
        return observations | ({"rewards": self.ret_rms} if self.norm_reward else {})

    def _seen(self) -> dict[str, RunningMeanStd]:
        return cast("dict[str, RunningMeanStd]", by_name(self.obs_rms, "observations"))

    def _clips(self) -> dict[str, float]:
        return {name: self.clip_reward if name == "rewards" else self.clip_obs for name in self._running()}

    def _see(self, observations: Observations) -> None:
        seen = by_name(observations, "observations")
        for name, running in self._seen().items() if self.norm_obs else ():
            if len(seen[name]):
                running.update(seen[name])

    def _earn(self, rewards: np.ndarray, valid: np.ndarray) -> None:
        # A row without a transition, such as one whose step has not ended yet, keeps its discounted return.
        self.returns = np.where(valid, self.returns * self.gamma + rewards, self.returns)
        if self.norm_reward and valid.any():
            self.ret_rms.update(self.returns[valid])


def normalizer_of(model: BaseAlgorithm) -> ValidNormalize | None:
    """Return the normalizer of a model; None if the model uses raw observations and rewards."""
    found = model.get_vec_normalize_env()
    return found if isinstance(found, ValidNormalize) else None
