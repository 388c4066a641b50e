"""Check an environment's first reset and first step against gymnasium's API.

gymnasium's own wrapper only warns, and training would continue with wrong rows. Here the same checks raise
an error that names the expected and the actual value. Numbers that are not finite are not checked here: the
learner reports them as divergence.
"""

from __future__ import annotations

import inspect
import re
import threading
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils.passive_env_checker import (
    check_action_space,
    check_observation_space,
    env_reset_passive_checker,
    env_step_passive_checker,
)
from gymnasium.wrappers import NormalizeObservation, NormalizeReward, OrderEnforcing, TimeLimit

from palaestra_trainer.errors import ConfigurationError

RESET = "reset(self, *, seed=None, options=None) that returns (observation, info)"
STEP = "step(self, action) that returns (observation, reward, terminated, truncated, info)"
_one_at_a_time = threading.Lock()  # warnings are caught for the whole process


def held(env: gymnasium.Env[Any, Any], name: str) -> gymnasium.Env[Any, Any]:
    """Return the environment in a wrapper that raises ConfigurationError if its first reset or step is wrong.

    It is checked twice: around and inside the wrappers of `gymnasium.make`, which unpack a step.

    Raises:
        ConfigurationError: its spaces, or the signatures of its methods, are wrong.
    """
    layer, lowest = env, None
    while isinstance(layer, gymnasium.Wrapper):
        lowest = layer if isinstance(layer, OrderEnforcing | TimeLimit) else lowest
        layer = layer.env
    if lowest is not None:
        lowest.env = Checked(lowest.env, name)
    return Checked(env, name)


def refuse_statistics(env: gymnasium.Env[Any, Any], name: str) -> None:
    """Refuse wrappers with statistics of their own: no model keeps them, and each simulator has others.

    Raises:
        ConfigurationError: there is one.
    """
    while isinstance(env, gymnasium.Wrapper):
        if isinstance(env, NormalizeObservation | NormalizeReward):
            raise ConfigurationError(
                f"environment.id: {name}: {type(env).__name__} has statistics that the policy's file lacks, "
                "other ones in each simulator; remove it, and set algorithm.normalize"
            )
        env = env.env


class Checked(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment whose first reset and first step are checked; its results are not changed.

    Args:
        env: the environment.
        name: its name in messages.

    Raises:
        ConfigurationError: its spaces, or the signatures of its methods, are wrong.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], name: str) -> None:
        super().__init__(env)
        self._name = name
        self._reset_seen = self._step_seen = False
        self._check_made()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Return the result of the environment's reset.

        Raises:
            ConfigurationError: the first reset is wrong.
        """
        result = self.env.reset(seed=seed, options=options)
        if not self._reset_seen:
            self._check("reset", RESET, result, env_reset_passive_checker)
            self._reset_seen = True
        return result

    def step(self, action: Any) -> Any:
        """Return the result of the environment's step.

        Raises:
            ConfigurationError: the first step is wrong.
        """
        result = self.env.step(action)
        if not self._step_seen:
            self._check("step", STEP, result, env_step_passive_checker)
            self._step_seen = True
        return result

    def _check_made(self) -> None:
        inner = self.env.unwrapped
        for method, positional, keywords, expected in (
            (inner.reset, (), {"seed": None, "options": None}, RESET),
            (inner.step, (None,), {}, STEP),
        ):
            signature = inspect.signature(method)
            try:
                signature.bind(*positional, **keywords)
            except TypeError as error:
                raise self._wrong(expected, f"{method.__name__}{signature} ({error})") from error
        for kind, check in (("observation", check_observation_space), ("action", check_action_space)):
            space: Any = getattr(self.env, f"{kind}_space", None)
            try:
                check(space)
            except (AssertionError, TypeError) as error:
                raise self._wrong(f"an {kind}_space of gymnasium.spaces", str(error)) from error

    def _check(self, method: str, expected: str, result: Any, check: Callable[..., Any]) -> None:
        lengths = {"reset": 2, "step": 5}
        if not isinstance(result, tuple) or len(result) != lengths[method]:
            raise self._wrong(expected, _kind(result))
        if not _finite(result[0]) or (method == "step" and not _finite(result[1])):
            return
        if fact := mismatch(self.observation_space, result[0]):
            raise self._wrong(f"from {method} an observation of {self.observation_space}", fact)
        for fact in _objections(check, _Returned(self.observation_space, result)):
            raise self._wrong(expected, fact)

    def _wrong(self, expected: str, came: str) -> ConfigurationError:
        return ConfigurationError(
            f"environment.id: {self._name}: expected {expected}; got {came}; fix the environment"
        )


class _Returned(gymnasium.Env[Any, Any]):
    """An environment that returns a recorded result, for gymnasium's checkers."""

    def __init__(self, space: spaces.Space[Any], result: Any) -> None:
        self.observation_space = space
        self._result = result

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Return the recorded result."""
        del seed, options
        return self._result

    def step(self, action: Any) -> Any:
        """Return the recorded result."""
        del action
        return self._result


def mismatch(space: spaces.Space[Any], observation: Any) -> str:
    """Return why an observation does not belong to its space, as text; "" if it does."""
    if isinstance(space, spaces.Dict):
        return _mismatch_of_dict(space, observation)
    if isinstance(space, spaces.Box):
        return _mismatch_of_box(space, observation)
    if space.contains(observation):
        return ""
    return _mismatch_of_shape(space, observation) or repr(observation)


def _mismatch_of_dict(space: spaces.Dict, observation: Any) -> str:
    if not isinstance(observation, dict):
        return _kind(observation)
    if observation.keys() != space.keys():
        return f"the keys {', '.join(map(str, observation))}, not {', '.join(space)}"
    facts = ((key, mismatch(part, observation[key])) for key, part in space.items())
    return "; ".join(f"{key}: {fact}" for key, fact in facts if fact)


def _mismatch_of_shape(space: spaces.Space[Any], observation: Any) -> str:
    """Return how the shape differs; "" if it does not, or if there is none."""
    shape = getattr(observation, "shape", space.shape)
    return "" if shape == space.shape else f"shape {shape}, not {space.shape}"


def _mismatch_of_box(space: spaces.Box, observation: Any) -> str:
    if not isinstance(observation, np.ndarray | np.generic):
        return _kind(observation)
    if fact := _mismatch_of_shape(space, observation):
        return fact
    if observation.dtype != space.dtype:
        return f"dtype {observation.dtype}, not {space.dtype}"
    numbers = np.asarray(observation)
    outside = np.argwhere((numbers < space.low) | (numbers > space.high))
    if not len(outside):
        return ""
    place = tuple(int(index) for index in outside[0])
    return f"{numbers[place]} at {list(place)}, not within {space.low[place]} and {space.high[place]}"


def _objections(check: Callable[..., Any], returned: _Returned) -> list[str]:
    """Return the complaints of one of gymnasium's checkers, from warnings and exceptions."""
    arguments = {"action": None} if check is env_step_passive_checker else {}
    with _one_at_a_time, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            check(returned, **arguments)
        except (AssertionError, gymnasium.error.Error) as error:
            return [str(error)]
    return [_plain(str(warning.message)) for warning in caught]


def _plain(warning: str) -> str:
    """Return the text of one of gymnasium's warnings without its color and its level."""
    return re.sub(r"^(\x1b\[\d+m)?WARN: |\x1b\[\d+m", "", warning)


def _kind(result: Any) -> str:
    if isinstance(result, tuple):
        return f"a tuple of {len(result)}: ({', '.join(type(part).__name__ for part in result)})"
    return f"a {type(result).__name__}"


def _finite(value: Any) -> bool:
    if isinstance(value, dict):
        return all(map(_finite, value.values()))
    numbers = np.asarray(value)
    return numbers.dtype.kind != "f" or bool(np.isfinite(numbers).all())
