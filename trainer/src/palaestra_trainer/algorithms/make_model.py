"""Check the algorithm of a job, and create the model.

Hyperparameters are keyword arguments of the algorithm's class. Names and values are checked against the
signature of the class, so a mistake is found before a simulator starts. Each value that a job sets replaces a
default.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import structlog
import torch
from gymnasium import spaces
from sb3_contrib import TQC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from palaestra_trainer.algorithms import buffer_options, hyperparameters, limits, noise, unknown_words
from palaestra_trainer.algorithms.images import note_transposed, with_channels_first, with_network
from palaestra_trainer.algorithms.inputs import give_copies
from palaestra_trainer.algorithms.normalization import ValidNormalize
from palaestra_trainer.algorithms.registry import ARENA_ENVIRONMENTS, RegisteredAlgorithm, entry_of
from palaestra_trainer.algorithms.space_compat import named_policy, policy_of_spaces
from palaestra_trainer.algorithms.valid_rows import refuse_asynchronous
from palaestra_trainer.errors import ConfigurationError, fact_of
from palaestra_trainer.job.configuration import Algorithm, Device

log = structlog.get_logger(__name__)


def check(algorithm: Algorithm) -> RegisteredAlgorithm:
    """Return the entry of the algorithm, after a check of its name and all its hyperparameters.

    Raises:
        ConfigurationError: a name is unknown or a value is wrong; the message has one line for each mistake,
            and suggests the nearest known name.
    """
    entry = entry_of(algorithm.name)
    policy = hyperparameters.policy_class(entry.original, named_policy(algorithm, entry))
    known = entry.known
    given = algorithm.hyperparameters
    lines = [
        *unknown_words.mistakes(
            algorithm.name,
            entry,
            hyperparameters.arguments_of(policy),
            given,
            hyperparameters.FIELD,
        )
    ]
    plain = {
        name: value for name, value in given.items() if name in known and name not in buffer_options.NAMES
    }
    lines += list(hyperparameters.mistakes(entry.original, policy, plain)) or _out_of_range(entry, plain)
    lines += noise.mistakes(given, hyperparameters.FIELD) if entry.takes_noise else []
    lines += buffer_options.mistakes({name: value for name, value in given.items() if name in known})
    if given.get("n_steps", 1) != 1 and "train_freq" in known:
        lines.append(
            "algorithm.hyperparameters.n_steps: rows of several simulators lie in one buffer, "
            "so only 1 works; leave it out"
        )
    if lines:
        raise ConfigurationError("\n".join(lines))
    return entry


def _out_of_range(entry: RegisteredAlgorithm, given: Mapping[str, Any]) -> list[str]:
    return [
        f"{hyperparameters.FIELD}.{name}: {fact}" for name, fact in limits.out_of_range(entry.original, given)
    ]


def _refuse_members(chosen: Mapping[str, Any], members: int) -> None:
    """Refuse hyperparameters that do not work with this number of collecting simulators."""
    if limits.needs_one_member(chosen) and members > 1:
        raise ConfigurationError(
            f"{hyperparameters.FIELD}.train_freq: counts in episodes, which only one collecting simulator "
            f"allows, but the job has {members}; count in steps, or use one collecting simulator"
        )
    if chosen.get("normalize_advantage") and (chosen.get("n_steps"), members) == (1, 1):
        raise ConfigurationError(
            f"{hyperparameters.FIELD}.n_steps: 1 step in 1 collecting simulator gives 1 row, but "
            "normalize_advantage needs 2; raise n_steps, add a simulator, or set normalize_advantage: false"
        )


def resolve(algorithm: Algorithm, environment: str) -> Algorithm:
    """Return the algorithm with all its hyperparameters, from the job or else from the defaults.

    Args:
        algorithm: the algorithm of the job.
        environment: the id of the job's environment.
    """
    arena = environment.rpartition(":")[2] in ARENA_ENVIRONMENTS
    return with_defaults(algorithm, entry_of(algorithm.name).arena if arena else {})


def with_defaults(algorithm: Algorithm, better: Mapping[str, Any]) -> Algorithm:
    """Return the algorithm with all its hyperparameters; values in `better` replace defaults of the class."""
    known = entry_of(algorithm.name).defaults
    return algorithm.model_copy(update={"hyperparameters": {**known, **better, **algorithm.hyperparameters}})


def make_model(algorithm: Algorithm, env: VecEnv, seed: int, device: Device = "cpu") -> BaseAlgorithm:
    """Return a new model of the algorithm for `env` on a device; its initial weights follow from `seed`.

    If the job sets `normalize`, the environment of the model normalizes observations and rewards, see
    `normalization`.

    Raises:
        ConfigurationError: the algorithm does not support the environment's spaces, or a hyperparameter has a
            wrong value.
    """
    entry = entry_of(algorithm.name)
    given = with_defaults(algorithm, {}).hyperparameters
    policy = policy_of_spaces(algorithm, entry, env.observation_space, env.action_space)
    added = noise.action_noise(given, env) if entry.takes_noise else None
    chosen = hyperparameters.arguments(
        entry.original,
        {name: value for name, value in given.items() if name not in {*noise.NAMES, *buffer_options.NAMES}},
    )
    chosen |= buffer_options.arguments(given, env.observation_space)
    if entry.takes_noise:
        chosen["action_noise"] = added
    chosen["policy_kwargs"] = with_network(chosen["policy_kwargs"], algorithm.cnn)
    if "target_update_interval" in chosen:
        # A vector step has num_envs steps, and the target network is updated at most once per vector step.
        chosen["target_update_interval"] = max(chosen["target_update_interval"], env.num_envs)
    if algorithm.normalize:
        if not algorithm.normalize.observations or isinstance(env.observation_space, spaces.Dict):
            env = with_channels_first(env)
        env = ValidNormalize(env, algorithm.normalize, chosen["gamma"])
    _refuse_members(chosen, env.num_envs)
    try:
        model = entry.cls(policy, env, seed=seed, device=_usable(device), **chosen)
    except ConfigurationError:
        raise
    except (ArithmeticError, AssertionError, AttributeError, LookupError, TypeError, ValueError) as error:
        # Stable-Baselines3 checks values and spaces by assertions, and a policy of the job's author may raise
        # any error. A RuntimeError is not caught, because it may come from a lack of device memory, and a
        # retry may help.
        raise ConfigurationError(
            f"algorithm: {algorithm.name} refuses its hyperparameters or the environment's spaces "
            f"({fact_of(error)}); change them, or use another algorithm"
        ) from error
    _refuse_dropping_all(model)
    refuse_asynchronous(model)
    give_copies(model)
    note_transposed(model)
    return model


def _refuse_dropping_all(model: BaseAlgorithm) -> None:
    """Refuse a TQC that drops all quantiles of its critics; their mean would be NaN."""
    if not isinstance(model, TQC) or model.top_quantiles_to_drop_per_net < model.critic.n_quantiles:
        return
    raise ConfigurationError(
        f"{hyperparameters.FIELD}.top_quantiles_to_drop_per_net: dropping "
        f"{model.top_quantiles_to_drop_per_net} of {model.critic.n_quantiles} quantiles of each critic "
        "leaves none; lower it, or raise policy_kwargs.n_quantiles"
    )


def _usable(wanted: Device) -> Device:
    """Return the wanted device; if PyTorch does not find a GPU, log a warning and return the CPU.

    The default is the CPU even on a node with a GPU, because networks of some hundred units learn faster on
    the CPU. A resumed run ends with exactly the numbers of an uninterrupted run only if both use the CPU.
    """
    if wanted == "cuda" and not torch.cuda.is_available():
        log.warning(
            "PyTorch sees no GPU, so the CPU is used",
            remedy="use a trainer image that is built with TORCH=cuda, on a node with a GPU",
        )
        return "cpu"
    return wanted
