"""The algorithms by name, their defaults, and what they refuse.

The defaults are those of the class, so Stable-Baselines3's. Only the arena's
environments have some of their own, which were found by trying. Whatever a
TrainingJob sets takes their place, one by one. Hyperparameters are keyword
arguments of the class and are checked against its signature, names and values,
so a mistake is found before a simulator is started.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from palaestra_trainer.algorithms import values
from palaestra_trainer.algorithms.device import usable
from palaestra_trainer.algorithms.images import policy_for, with_channels_first, with_network
from palaestra_trainer.algorithms.normalization import ValidNormalize
from palaestra_trainer.algorithms.reinforce import REINFORCE
from palaestra_trainer.algorithms.rows import A2C, DQN, PPO, SAC
from palaestra_trainer.configuration import Algorithm, Device, nearest
from palaestra_trainer.errors import ConfigurationError

# Arguments of the classes that the training loop itself gives, or that valid-row buffers
# cannot honour: they store rows of several members in one line.
OURS = frozenset(
    {
        "self", "policy", "env", "seed", "device", "verbose", "tensorboard_log", "_init_setup_model",
        "replay_buffer_class", "replay_buffer_kwargs", "optimize_memory_usage",
        "rollout_buffer_class", "rollout_buffer_kwargs", "action_noise",
    }
)  # fmt: skip


ARENA_ENVIRONMENTS = frozenset({"MoveToTargetEnv-v0"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One algorithm.

    Attributes:
        cls: its class.
        arena: hyperparameters that suit the arena's environments better than the defaults of the class.
    """

    cls: type[BaseAlgorithm]
    arena: Mapping[str, Any]

    @property
    def defaults(self) -> dict[str, Any]:
        """The defaults of the class, which are Stable-Baselines3's."""
        parameters = inspect.signature(self.cls.__init__).parameters
        return {name: parameter.default for name, parameter in parameters.items() if name not in OURS}


def _entry(cls: type[BaseAlgorithm], **arena: Any) -> Entry:
    return Entry(cls=cls, arena=MappingProxyType(arena))


ALGORITHMS: Mapping[str, Entry] = MappingProxyType(
    {
        # Soft target updates at every step and as many gradient steps as environment steps:
        # hard updates ended 10 points lower on the same 50,000 steps.
        "DQN": _entry(
            DQN,
            learning_rate="lin_5e-4",
            buffer_size=100_000,
            learning_starts=1_000,
            batch_size=128,
            tau=0.005,
            gamma=0.93,
            train_freq=4,
            gradient_steps=4,
            target_update_interval=1,
            exploration_fraction=0.1,
            exploration_final_eps=0.05,
            policy_kwargs={"net_arch": [256, 256]},
        ),
        "SAC": _entry(
            SAC,
            learning_rate=5e-4,
            buffer_size=100_000,
            learning_starts=1_000,
            batch_size=128,
            gamma=0.97,
            train_freq=4,
            gradient_steps=4,
            policy_kwargs={"net_arch": [256, 256]},
        ),
        "PPO": _entry(
            PPO,
            learning_rate=5e-4,
            n_steps=512,
            batch_size=128,
            gamma=0.97,
            ent_coef=0.005,
            policy_kwargs={"net_arch": [128, 128]},
        ),
        "A2C": _entry(A2C, gamma=0.97, ent_coef=0.005, policy_kwargs={"net_arch": [128, 128]}),
        "REINFORCE": _entry(
            REINFORCE,
            learning_rate=2e-3,
            gamma=0.97,
            ent_coef=0.005,
            policy_kwargs={"net_arch": [128, 128]},
        ),
    }
)


def check(algorithm: Algorithm) -> Entry:
    """Return the entry of the algorithm if its name and all its hyperparameters are right.

    Raises:
        ConfigurationError: one line for each unknown name, with the nearest known one, and each wrong value.
    """
    entry = ALGORITHMS.get(algorithm.name)
    if entry is None:
        raise ConfigurationError(
            f"algorithm.name: {algorithm.name} is not an algorithm; "
            f"{nearest(algorithm.name, dict(ALGORITHMS))}"
        )
    known = list(entry.defaults)
    given = algorithm.hyperparameters
    lines = [
        f"{values.FIELD}.{name}: {algorithm.name} has no such hyperparameter; {nearest(name, known)}"
        for name in given
        if name not in known
    ]
    lines += values.mistakes(entry.cls, {name: value for name, value in given.items() if name in known})
    if given.get("n_steps", 1) != 1 and "train_freq" in known:
        lines.append(
            "algorithm.hyperparameters.n_steps: rows of several simulators lie in one buffer, "
            "so only 1 works; leave it out"
        )
    if lines:
        raise ConfigurationError("\n".join(lines))
    return entry


def resolve(algorithm: Algorithm, environment: str) -> Algorithm:
    """Return the algorithm with all its hyperparameters: those that are given, and defaults for the rest.

    Args:
        algorithm: what the job says.
        environment: the id of its environment, as the job says it.
    """
    arena = environment.rpartition(":")[2] in ARENA_ENVIRONMENTS
    return with_defaults(algorithm, ALGORITHMS[algorithm.name].arena if arena else {})


def with_defaults(algorithm: Algorithm, better: Mapping[str, Any]) -> Algorithm:
    """Return the algorithm with all its hyperparameters; those of `better` precede the class's defaults."""
    known = ALGORITHMS[algorithm.name].defaults
    return algorithm.model_copy(update={"hyperparameters": {**known, **better, **algorithm.hyperparameters}})


def make_model(algorithm: Algorithm, env: VecEnv, seed: int, device: Device = "cpu") -> BaseAlgorithm:
    """Return a new model of the algorithm for `env` on a device, its networks drawn from `seed`.

    Where the algorithm is to normalize, the model's own environment does, see `normalization`.
    Images get CnnPolicy, all else MlpPolicy, unless the hyperparameter `policy` says otherwise: a run has it
    that began when every observation got MlpPolicy.

    Raises:
        ConfigurationError: it doesn't fit the environment, or a hyperparameter has a wrong value.
    """
    entry = ALGORITHMS[algorithm.name]
    if not isinstance(env.observation_space, spaces.Box):
        raise ConfigurationError(
            f"environment.id: its observation is a {type(env.observation_space).__name__}; "
            "give it one Box, e.g. by gymnasium's FlattenObservation"
        )
    given = with_defaults(algorithm, {}).hyperparameters
    policy = given.pop("policy", None) or policy_for(env.observation_space, algorithm)
    chosen = values.arguments(entry.cls, given)
    chosen["policy_kwargs"] = with_network(chosen["policy_kwargs"], algorithm.cnn)
    if "target_update_interval" in chosen:
        # A vector step is num_envs steps: the target can't be updated more often than that.
        chosen["target_update_interval"] = max(chosen["target_update_interval"], env.num_envs)
    if algorithm.normalize:
        if not algorithm.normalize.observations:
            env = with_channels_first(env)
        env = ValidNormalize(env, algorithm.normalize, chosen["gamma"])
    if chosen.get("normalize_advantage") and (chosen.get("n_steps"), env.num_envs) == (1, 1):
        raise ConfigurationError(
            f"{values.FIELD}.n_steps: 1 step of 1 collecting simulator is 1 row, and normalize_advantage "
            "needs 2; raise n_steps, add a simulator, or set normalize_advantage: false"
        )
    try:
        return entry.cls(policy, env, seed=seed, device=usable(device), **chosen)
    except (AssertionError, TypeError, ValueError) as error:
        # Stable-Baselines3 checks values and spaces by assertions.
        raise ConfigurationError(
            f"algorithm: {algorithm.name} refuses its hyperparameters or the environment's spaces "
            f"({error}); change them, or use another algorithm"
        ) from error
