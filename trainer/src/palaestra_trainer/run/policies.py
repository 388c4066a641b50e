"""A trained policy that takes unnormalized observations, and the settings of its environment."""

from __future__ import annotations

import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm

from palaestra_trainer.algorithms import ALGORITHMS
from palaestra_trainer.checkpoint.tensors import NORMALIZE
from palaestra_trainer.configuration import load
from palaestra_trainer.environments.making import keywords
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.run_directory import RunDirectory


@dataclass(frozen=True, slots=True, kw_only=True)
class Policy:
    """A policy with its normalizer.

    Attributes:
        model: the Stable-Baselines3 model, which learned from normalized observations.
        environment_id: name of the environment that it learned in.
        environment_options: keyword arguments of that environment, without robot and scene.
        scale: mean, variance, clip and epsilon of the observations; None: they are not normalized.
    """

    model: BaseAlgorithm
    environment_id: str
    environment_options: dict[str, Any]
    scale: tuple[np.ndarray, np.ndarray, float, float] | None

    def predict(
        self,
        observation: np.ndarray,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,  # noqa: FBT001, FBT002 - as in Stable-Baselines3
    ) -> tuple[Any, Any]:
        """Return an action for an observation as the environment returned it, and the policy's next state."""
        return self.model.predict(self._seen(observation), state, episode_start, deterministic)

    def _seen(self, observation: np.ndarray) -> np.ndarray:
        if self.scale is None:
            return observation
        mean, variance, clip, epsilon = self.scale
        scaled = (observation - mean) / np.sqrt(variance + epsilon)
        return np.asarray(np.clip(scaled, -clip, clip), np.float32)


def load_policy(run_or_zip: str | Path) -> Policy:
    """Return the policy of a run directory, or of a model zip inside one.

    Stable-Baselines3 unpickles the zip, so load only files that you trust.

    Raises:
        ConfigurationError: there is no model, or no training.yaml beside it.
    """
    path = Path(run_or_zip)
    model = RunDirectory(path).model if path.is_dir() else path
    if not model.is_file():
        raise ConfigurationError(f"{model}: does not exist; train first, or give another run directory")
    configuration = load(RunDirectory(model.parent).configuration)
    environment = configuration.environment
    return Policy(
        model=ALGORITHMS[configuration.algorithm.name].cls.load(model, device="cpu"),
        environment_id=environment.id,
        environment_options=keywords(environment),
        scale=_scale(model),
    )


def _scale(model: Path) -> tuple[np.ndarray, np.ndarray, float, float] | None:
    with zipfile.ZipFile(model) as archive:
        known = json.loads(archive.read(NORMALIZE)) if NORMALIZE in archive.namelist() else {}
    if "observations" not in known:
        return None
    seen = known["observations"]
    return np.array(seen["mean"]), np.array(seen["variance"]), float(seen["clip"]), float(known["epsilon"])
