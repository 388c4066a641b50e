"""The table of algorithms, with their defaults.

The defaults are those of the algorithm's class in Stable-Baselines3, in sb3-contrib, or in this package for
REINFORCE. Only the environments of the arena have other defaults, which were found by experiments. A job may
also name a class of its author as `module:Class`; `entry_of` creates its entry.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any

import sb3_contrib
import stable_baselines3 as sb3
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from palaestra_protocol.foreign_words import NO_ALGORITHM
from palaestra_trainer.algorithms import buffer_options, noise
from palaestra_trainer.algorithms.constructor_params import parameters
from palaestra_trainer.algorithms.reinforce import REINFORCE
from palaestra_trainer.algorithms.valid_rows import with_valid_rows
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import nearest
from palaestra_trainer.job.user_code import imports

# A job cannot set these arguments of an algorithm's class as hyperparameters. The training loop sets some of
# these arguments, and other modules check others. `optimize_memory_usage` does not work with buffers for
# valid rows, because they store rows of several members in one column.
OURS = frozenset(
    {
        "self", "policy", "env", "seed", "device", "verbose", "tensorboard_log", "_init_setup_model",
        "replay_buffer_class", "replay_buffer_kwargs", "optimize_memory_usage",
        "rollout_buffer_class", "rollout_buffer_kwargs", "action_noise",
    }
)  # fmt: skip
ARENA_ENVIRONMENTS = frozenset({"MoveToTargetEnv-v0"})
_ANY_ACTIONS = (spaces.Box, spaces.Discrete, spaces.MultiDiscrete, spaces.MultiBinary)
# True: number of episodes, for an off-policy algorithm; False: number of rollouts.
_LOG_INTERVAL = {True: 10, False: 1}


@dataclass(frozen=True, slots=True, kw_only=True)
class RegisteredAlgorithm:
    """The entry of an algorithm.

    Attributes:
        original: the algorithm's class in its package; this class loads a model.zip.
        arena: hyperparameters that are better for the arena's environments than the defaults of the class.
        actions: types of action spaces that the algorithm supports; None: unknown until a model is created.
        log_interval: number of episodes (off-policy) or rollouts (on-policy) between two records of values.
    """

    original: type[BaseAlgorithm]
    arena: Mapping[str, Any]
    actions: tuple[type[spaces.Space[Any]], ...] | None
    log_interval: int

    @property
    def cls(self) -> type[BaseAlgorithm]:
        """The subclass that counts only valid rows, and learns only from valid rows."""
        return with_valid_rows(self.original)

    @property
    def takes_noise(self) -> bool:
        """Whether a job may add noise to the algorithm's actions."""
        return "action_noise" in parameters(self.original)

    @property
    def replays(self) -> bool:
        """Whether the algorithm learns from a replay buffer."""
        return issubclass(self.original, OffPolicyAlgorithm)

    @property
    def takes_rollout_buffers(self) -> bool:
        """Whether the class of the algorithm's rollout buffer is one of its arguments."""
        return buffer_options.ROLLOUT.chooser in parameters(self.original)

    @property
    def known(self) -> list[str]:
        """The names of the algorithm's hyperparameters."""
        names = [name for name in parameters(self.original) if name not in OURS]
        return [
            *names,
            *(noise.NAMES if self.takes_noise else ()),
            *(buffer_options.REPLAY.names if self.replays else ()),
            *(buffer_options.ROLLOUT.names if self.takes_rollout_buffers else ()),
        ]

    @property
    def defaults(self) -> dict[str, Any]:
        """The defaults of the class, except values that JSON cannot write."""
        known = parameters(self.original)
        return {
            name: known[name].default
            for name in self.known
            if name in known and name not in buffer_options.NAMES and _is_plain(known[name])
        }


def _is_plain(parameter: inspect.Parameter) -> bool:
    if parameter.default is inspect.Parameter.empty:
        return False
    try:
        json.dumps(parameter.default)
    except TypeError:
        return False
    return True


def _entry(
    original: type[BaseAlgorithm],
    *actions: type[spaces.Space[Any]],
    log_interval: int | None = None,
    **arena: Any,
) -> RegisteredAlgorithm:
    off_policy = issubclass(original, OffPolicyAlgorithm)
    return RegisteredAlgorithm(
        original=original,
        arena=MappingProxyType(arena),
        actions=actions or None,
        log_interval=log_interval or _LOG_INTERVAL[off_policy],
    )


ALGORITHMS: Mapping[str, RegisteredAlgorithm] = MappingProxyType(
    {
        # DQN has soft target updates at every step, and as many gradient steps as environment steps. With
        # hard updates, the success rate after 50,000 steps was 10 percentage points lower.
        "DQN": _entry(
            sb3.DQN,
            spaces.Discrete,
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
            sb3.SAC,
            spaces.Box,
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
            sb3.PPO,
            *_ANY_ACTIONS,
            learning_rate=5e-4,
            n_steps=512,
            batch_size=128,
            gamma=0.97,
            ent_coef=0.005,
            policy_kwargs={"net_arch": [128, 128]},
        ),
        "A2C": _entry(
            sb3.A2C,
            *_ANY_ACTIONS,
            log_interval=50,
            gamma=0.97,
            ent_coef=0.005,
            policy_kwargs={"net_arch": [128, 128]},
        ),
        "REINFORCE": _entry(
            REINFORCE,
            *_ANY_ACTIONS,
            learning_rate=2e-3,
            gamma=0.97,
            ent_coef=0.005,
            policy_kwargs={"net_arch": [128, 128]},
        ),
        "TD3": _entry(sb3.TD3, spaces.Box),
        "DDPG": _entry(sb3.DDPG, spaces.Box),
        "QRDQN": _entry(sb3_contrib.QRDQN, spaces.Discrete),
        "TQC": _entry(sb3_contrib.TQC, spaces.Box),
        "CrossQ": _entry(sb3_contrib.CrossQ, spaces.Box),
        "TRPO": _entry(sb3_contrib.TRPO, *_ANY_ACTIONS),
        "RecurrentPPO": _entry(sb3_contrib.RecurrentPPO, spaces.Box, spaces.Discrete, spaces.MultiDiscrete),
        "MaskablePPO": _entry(
            sb3_contrib.MaskablePPO, spaces.Discrete, spaces.MultiDiscrete, spaces.MultiBinary
        ),
    }
)


@cache
def entry_of(name: str) -> RegisteredAlgorithm:
    """Return the entry of an algorithm: from the table, or a new entry for a class `module:Class`.

    Raises:
        ConfigurationError: no algorithm has that name, or the class cannot be used as an algorithm.
    """
    if name in ALGORITHMS:
        return ALGORITHMS[name]
    if why := NO_ALGORITHM.get(_plain_name(name).lower()):
        raise ConfigurationError(f"algorithm.name: {name} cannot be used: {why}")
    if imports.names_class(name):
        entry = _entry(imports.class_named(name, "algorithm.name", BaseAlgorithm))
        with_valid_rows(entry.original)  # raises an error if the algorithm would learn from invalid rows
        return entry
    raise ConfigurationError(
        f"algorithm.name: {name} is not an algorithm; {nearest(name, dict(ALGORITHMS))} "
        "or name your own class as module:Class"
    )


def _plain_name(name: str) -> str:
    """Return the name of a class; without its module for a class of Stable-Baselines3 or sb3-contrib."""
    module, _, last = name.rpartition(":")
    return last if module.partition(".")[0] in {"sb3_contrib", "stable_baselines3"} else name
