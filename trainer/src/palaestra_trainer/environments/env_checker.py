"""Check the results of an environment against gymnasium's API.

gymnasium's own wrapper only warns, so training would continue with wrong rows. The wrapper of this module
applies gymnasium's checks to the first reset and the first step. It raises an error that names the expected
and the actual value. For later results, the wrapper checks types and shapes, see `contract`. It does not
check for NaN and infinity, because the learner reports these numbers as divergence.
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

from palaestra_trainer.environments.contract import broken_by_reset, broken_by_step, kind_of, mismatch
from palaestra_trainer.errors import ConfigurationError

RESET = "reset(self, *, seed=None, options=None) that returns (observation, info)"
STEP = "step(self, action) that returns (observation, reward, terminated, truncated, info)"
_one_at_a_time = threading.Lock()  # `catch_warnings` affects all threads


def held(env: gymnasium.Env[Any, Any], name: str) -> gymnasium.Env[Any, Any]:
    """Wrap the environment so that a wrong result of a reset or a step raises ConfigurationError.

    There is a check outside and another inside the wrappers of `gymnasium.make`, because these wrappers
    unpack the result of a step.

    Raises:
        ConfigurationError: the environment's spaces or the signatures of its methods are wrong.
    """
    layer, lowest = env, None
    while isinstance(layer, gymnasium.Wrapper):
        lowest = layer if isinstance(layer, OrderEnforcing | TimeLimit) else lowest
        layer = layer.env
    if lowest is not None:
        lowest.env = Checked(lowest.env, name)
    return Checked(env, name)


def refuse_statistics(env: gymnasium.Env[Any, Any], name: str) -> None:
    """Refuse wrappers with statistics: a model does not save statistics, and they differ between simulators.

    Raises:
        ConfigurationError: the environment has such a wrapper.
    """
    while isinstance(env, gymnasium.Wrapper):
        if isinstance(env, NormalizeObservation | NormalizeReward):
            raise ConfigurationError(
                f"environment.id: {name}: {type(env).__name__} has statistics that the policy's file lacks, "
                "and they differ between simulators; remove the wrapper, and set algorithm.normalize"
            )
        env = env.env


class Checked(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A wrapper that checks the results of resets and steps, and returns them unchanged.

    Args:
        env: the environment to check.
        name: name of the environment in messages.

    Raises:
        ConfigurationError: the environment's spaces or the signatures of its methods are wrong.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], name: str) -> None:
        super().__init__(env)
        self._name = name
        self._reset_seen = self._step_seen = False
        self._episodes = self._steps = 0
        self._check_made()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Return the result of the environment's reset.

        Raises:
            ConfigurationError: the result is wrong.
        """
        result = self.env.reset(seed=seed, options=options)
        self._episodes, self._steps = self._episodes + 1, 0
        if not self._reset_seen:
            self._check("reset", RESET, result, env_reset_passive_checker)
            self._reset_seen = True
        elif fact := broken_by_reset(self.observation_space, result):
            raise self._wrong(RESET, f"{fact}, {self._where()}")
        return result

    def step(self, action: Any) -> Any:
        """Return the result of the environment's step.

        Raises:
            ConfigurationError: the result is wrong.
        """
        result = self.env.step(action)
        self._steps += 1
        if not self._step_seen:
            self._check("step", STEP, result, env_step_passive_checker)
            self._step_seen = True
        elif fact := broken_by_step(self.observation_space, result):
            raise self._wrong(STEP, f"{fact}, {self._where()}")
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
            raise self._wrong(expected, kind_of(result))
        if not _finite(result[0]) or (method == "step" and not _finite(result[1])):
            return
        if fact := mismatch(self.observation_space, result[0]):
            raise self._wrong(f"from {method} an observation of {self.observation_space}", fact)
        for fact in _objections(check, _Returned(self.observation_space, result)):
            raise self._wrong(expected, fact)

    def _where(self) -> str:
        return f"in step {self._steps} of its episode {self._episodes}" if self._steps else "in a later reset"

    def _wrong(self, expected: str, came: str) -> ConfigurationError:
        return ConfigurationError(
            f"environment.id: {self._name}: expected {expected}; got {came}; fix the environment"
        )


class _Returned(gymnasium.Env[Any, Any]):
    """An environment that returns a recorded result, as an argument of gymnasium's checkers."""

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


def _objections(check: Callable[..., Any], returned: _Returned) -> list[str]:
    """Return the text of the warnings and the exception of one of gymnasium's checkers."""
    arguments = {"action": None} if check is env_step_passive_checker else {}
    with _one_at_a_time, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            check(returned, **arguments)
        except (AssertionError, gymnasium.error.Error) as error:
            return [str(error)]
    return [plain_warning(str(warning.message)) for warning in caught]


def plain_warning(warning: str) -> str:
    """Return the text of one of gymnasium's warnings without its color and its level."""
    return re.sub(r"^(\x1b\[\d+m)?WARN: |\x1b\[\d+m", "", warning)


def _finite(value: Any) -> bool:
    if isinstance(value, dict):
        return all(map(_finite, value.values()))
    numbers = np.asarray(value)
    return numbers.dtype.kind != "f" or bool(np.isfinite(numbers).all())
