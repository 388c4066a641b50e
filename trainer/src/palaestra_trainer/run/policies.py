"""Load a trained policy that takes raw observations, with the settings of its environment."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm

from palaestra_trainer.algorithms import entry_of, takes_masks
from palaestra_trainer.environments.make import keywords, make_environment
from palaestra_trainer.environments.masks import ACTION_MASKS, masks_in
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import DEFAULT_ROBOT, Configuration, Environment, load
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.robots.base import RobotAbc, Scene
from palaestra_trainer.robots.simulated import SimulatedRobot
from palaestra_trainer.run.byte_code import refuse_another_python
from palaestra_trainer.run.checkpoint.tensors import NORMALIZE
from palaestra_trainer.simulators.robot_registry import robot_class


class Scale(NamedTuple):
    """The statistics and limits that normalize a part of an observation."""

    mean: np.ndarray
    variance: np.ndarray
    clip: float
    epsilon: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainedPolicy:
    """A policy with its normalizer.

    Attributes:
        model: the Stable-Baselines3 model, which needs normalized observations if the run normalized them.
        environment_id: name of the environment in which the policy learned.
        environment_options: keyword arguments of that environment, without robot and scene.
        robot: the class of the robot that learned, as `trainer.robot` of the job names it.
        environment: the job's settings of that environment, including its wrappers.
        scales: mean, variance, clip and epsilon by the key of the observation, or by "" if the observation is
            not a Dict; values under other keys are not normalized.
    """

    model: BaseAlgorithm
    environment_id: str
    environment_options: dict[str, Any]
    robot: str
    environment: Environment
    scales: Mapping[str, Scale]

    @property
    def robot_class(self) -> type[SimulatedRobot]:
        """The class of the robot that learned.

        Raises:
            ConfigurationError: the class cannot be imported.
        """
        return robot_class(self.robot)

    @property
    def takes_masks(self) -> bool:
        """Whether the policy chooses only among allowed actions, as a policy of MaskablePPO does."""
        return takes_masks(self.model)

    def make_env(self, robot: RobotAbc, scene: Scene) -> gymnasium.Env[Any, Any]:
        """Return the environment in which the policy learned, with its wrappers, for a robot and its scene.

        As in a run, the environment gets robot and scene only if its signature accepts them.

        Raises:
            ConfigurationError: the environment is not registered, or its signature does not fit.
            MissingCapability: the robot lacks a capability in the environment's `needs`.
        """
        return make_environment(self.environment, robot, scene)

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,  # noqa: FBT001, FBT002 - as in Stable-Baselines3
        action_masks: Any = None,
    ) -> tuple[Any, Any]:
        """Return an action for a raw observation of the environment, and the policy's next state.

        A policy of MaskablePPO needs the masks that the environment's `action_masks` returns. Other policies
        do not take masks.

        Raises:
            ValueError: masks are missing or wrong for a policy that needs masks, or were given to another
                policy.
        """
        masks = self._masks(action_masks)
        return self.model.predict(self._seen(observation), state, episode_start, deterministic, **masks)

    def _masks(self, given: Any) -> dict[str, Any]:
        """Return the masks as a keyword argument of the model's `predict`; empty if the model takes none."""
        if not self.takes_masks:
            if given is None:
                return {}
            raise ValueError(
                f"action_masks: {type(self.model).__name__} chooses among all actions; leave them out, or "
                "train with MaskablePPO"
            )
        if given is None:
            raise ValueError(
                "action_masks: the policy chooses only among allowed actions; pass "
                'env.get_wrapper_attr("action_masks")(), or numpy.ones to allow all'
            )
        try:
            return {ACTION_MASKS: masks_in(given, self.model.action_space)}
        except ValueError as error:
            raise ValueError(f"action_masks: {error}; pass the masks of the environment") from error

    def _seen(self, observation: Any) -> Any:
        if isinstance(observation, Mapping):
            return {key: self._scaled(key, part) for key, part in observation.items()}
        return self._scaled("", observation)

    def _scaled(self, key: str, part: Any) -> Any:
        if key not in self.scales:
            return part
        mean, variance, clip, epsilon = self.scales[key]
        scaled = (part - mean) / np.sqrt(variance + epsilon)
        return np.asarray(np.clip(scaled, -clip, clip), np.float32)


def load_policy(run_or_zip: str | Path) -> TrainedPolicy:
    """Return the trained policy of a run directory or of its model.zip.

    Stable-Baselines3 unpickles the zip, so load only files that you trust.

    Raises:
        ConfigurationError: the model, or training.yaml in its folder, is missing; or the model has byte code
            of another version of Python.
    """
    path = Path(run_or_zip)
    model = RunDirectory(path).model if path.is_dir() else path
    if not model.is_file():
        raise ConfigurationError(f"{model}: does not exist; train first, or give another run directory")
    configuration = load(RunDirectory(model.parent).configuration)
    environment = configuration.environment
    return TrainedPolicy(
        model=_load(model, configuration),
        environment_id=environment.id,
        environment_options=keywords(environment),
        robot=configuration.robot or DEFAULT_ROBOT,
        environment=environment,
        scales=_scales(model),
    )


def _load(model: Path, configuration: Configuration) -> BaseAlgorithm:
    refuse_another_python(model)
    return entry_of(configuration.algorithm.name).original.load(model, device="cpu")


def _scales(model: Path) -> dict[str, Scale]:
    with zipfile.ZipFile(model) as archive:
        known = json.loads(archive.read(NORMALIZE)) if NORMALIZE in archive.namelist() else {}
    return {
        name.removeprefix("observations").removeprefix("/"): Scale(
            np.array(seen["mean"]), np.array(seen["variance"]), float(seen["clip"]), float(known["epsilon"])
        )
        for name, seen in known.items()
        if name.startswith("observations")
    }
