"""A hyperparameter file of RL-Baselines3-Zoo: its entries by environment, and its algorithm."""

import difflib
import re
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

from palaestra.api.fields import ALGORITHM, ALGORITHMS
from palaestra.api.yaml_io import NotYaml, read
from palaestra.errors import PalaestraError
from palaestra_protocol.foreign_words import NO_ALGORITHM

# The names of Zoo's hyperparameter files, and the algorithms that they are for.
OF_FILES: Mapping[str, str] = {
    "a2c": "A2C",
    "crossq": "CrossQ",
    "ddpg": "DDPG",
    "dqn": "DQN",
    "ppo": "PPO",
    "ppo_lstm": "RecurrentPPO",
    "qrdqn": "QRDQN",
    "sac": "SAC",
    "td3": "TD3",
    "tqc": "TQC",
    "trpo": "TRPO",
}
_SHARED = ("default", "atari")  # entries that are not named after one environment
# A key of Zoo's her.yml, from the time when HER was an algorithm and not a replay buffer.
CHOOSES_ALGORITHM = "model_class"
_LONGEST_LIST = 12
_OF_AN_ENTRY = "n_timesteps"  # every entry has this key


class ZooError(PalaestraError, ValueError):
    """A file of RL-Baselines3-Zoo cannot be converted."""


def read_file(text: str, name: str) -> Mapping[str, Any]:
    """Return the document of a file.

    Raises:
        ZooError: the file is not YAML, or has no entries.
    """
    if "python/object" in text:
        raise ZooError(
            f"{name}: is a config.yml that Zoo wrote with Python objects in it; name the file of "
            "hyperparameters that it was made from, such as hyperparams/ppo.yml"
        )
    try:
        data = read(text, name)
    except NotYaml as error:
        raise ZooError(error.problem) from None
    if not isinstance(data, dict) or not data:
        raise ZooError(
            f"{name}: has no entries with names of environments; name a file such as Zoo's "
            "hyperparams/ppo.yml"
        )
    return data


def entry_of(data: Mapping[str, Any], name: str, env: str | None) -> tuple[str, Mapping[str, Any], str]:
    """Return the id of an environment, its entry, and the name of the entry.

    As in Zoo, an environment without an entry gets the entry `default`.

    Raises:
        ZooError: the file does not have the entry, or has several entries and `env` is None.
    """
    if _OF_AN_ENTRY in data:
        if env is None:
            raise ZooError(
                f"{name}: has the hyperparameters of one environment, but not its id; give the id as --env ID"
            )
        return env, data, env
    ids = [each for each in data if each not in _SHARED]
    if env is None:
        if len(ids) != 1:
            raise ZooError(f"{name}: has {len(ids)} environments; choose one as --env ID: {_listed(ids)}")
        env = ids[0]
    chosen = env if env in data and env not in _SHARED else "default"
    if env in _SHARED or chosen not in data:
        near = difflib.get_close_matches(env, ids, n=1)
        remedy = f"did you mean {near[0]}?" if near else f"use one of {_listed(ids)}"
        raise ZooError(f"--env: {env} is not an environment in {name}; {remedy}")
    entry = data[chosen]
    if not isinstance(entry, dict):
        raise ZooError(f"{name}: the entry {chosen} is not a mapping; write lines of 'name: value' below it")
    return env, entry, chosen


def algorithm_of(given: str | None, name: str, entry: Mapping[str, Any]) -> str:
    """Return the algorithm: `given`, or else the algorithm of the entry, or else of the file.

    Raises:
        ZooError: the algorithm is unknown, or Palaestra cannot use it.
    """
    word = str(given or entry.get(CHOOSES_ALGORITHM) or PurePath(name).stem)
    here = {**{known.lower(): known for known in ALGORITHMS}, **OF_FILES}
    if found := here.get(word.lower()):
        return found
    if why := NO_ALGORITHM.get(word.lower()):
        raise ZooError(f"--algorithm: {word} cannot be used: {why}")
    if given is not None and re.fullmatch(ALGORITHM, given):
        return given
    subject = f"--algorithm: {given} is" if given is not None else f"{name}: the file's name is"
    raise ZooError(f"{subject} not an algorithm; give one as --algorithm: {', '.join(ALGORITHMS)}")


def _listed(ids: list[str]) -> str:
    more = f" and {len(ids) - _LONGEST_LIST} more" if len(ids) > _LONGEST_LIST else ""
    return ", ".join(ids[:_LONGEST_LIST]) + more
