"""Apply the wrappers of a job to its environment, and stack the newest observations.

The environment of every simulator has these wrappers, so they are the same in training, in evaluations, after
a resume and in programs of users. `env_checker` refuses wrappers with statistics.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from palaestra_trainer.errors import ConfigurationError, TrainerError, fact_of
from palaestra_trainer.job.configuration import Environment
from palaestra_trainer.job.user_code import imports
from palaestra_trainer.job.user_code.kwargs import AcceptedArguments

FIELD = "environment.wrappers"
_AXES_OF_AN_IMAGE = 3
_BRIGHTEST = 255


def mistakes(wanted: Environment) -> Iterator[str]:
    """Yield a message with field, fact and remedy for each wrapper that cannot be used."""
    for index, wrapper in enumerate(wanted.wrappers or ()):
        field = f"{FIELD}[{index}]"
        try:
            cls = imports.class_named(wrapper.name, f"{field}.name", gymnasium.Wrapper)
        except ConfigurationError as error:
            yield str(error)
        else:
            yield from AcceptedArguments(cls, wrapper.name).mistakes(
                f"{field}.options", wrapper.options, ("env",)
            )


def wrapped(env: gymnasium.Env[Any, Any], wanted: Environment) -> gymnasium.Env[Any, Any]:
    """Return the environment in the wrappers of a job, the first wrapper innermost, frame stacking outermost.

    Raises:
        ConfigurationError: a wrapper cannot be created, or the observations cannot be stacked.
    """
    for index, wrapper in enumerate(wanted.wrappers or ()):
        field = f"{FIELD}[{index}]"
        cls = imports.class_named(wrapper.name, f"{field}.name", gymnasium.Wrapper)
        try:
            env = cls(env, **wrapper.options)
        except TrainerError:
            raise
        except Exception as error:  # the constructor may be the user's code
            raise ConfigurationError(
                f"{field}: {wrapper.name} cannot be created ({fact_of(error)}); "
                "change its options, or remove it"
            ) from error
    return env if wanted.frame_stack is None else StackedFrames(env, wanted.frame_stack)


class StackedFrames(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A wrapper that stacks the newest observations of an episode, in the layout of VecFrameStack.

    Images are stacked along their channels, and other observations along their last axis. The oldest
    observation comes first. At the beginning of an episode, zeros stand for the missing older observations.

    Args:
        env: the environment, whose observation must be a Box.
        frames: number of observations in a stack.

    Raises:
        ConfigurationError: the observation is not a Box with an axis.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], frames: int) -> None:
        super().__init__(env)
        space = env.observation_space
        if not (isinstance(space, spaces.Box) and space.shape):
            raise ConfigurationError(
                f"environment.frameStack: the observation is a {type(space).__name__} of shape "
                f"{space.shape}, but only a Box with an axis can be stacked; remove frameStack"
            )
        self._axis = 0 if _has_channels_first(space) else -1
        self._width = space.shape[self._axis]
        low, high = (np.concatenate([bound] * frames, self._axis) for bound in (space.low, space.high))
        self.observation_space = spaces.Box(low, high, dtype=low.dtype.type)
        self._stacked = np.zeros_like(low)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Return the first observation of an episode, stacked after zeros."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._stacked = np.zeros_like(self._stacked)
        return self._with(observation), info

    def step(self, action: Any) -> Any:
        """Return the result of a step, with the newest observations."""
        observation, *others = self.env.step(action)
        return self._with(observation), *others

    def _with(self, observation: Any) -> np.ndarray:
        """Stack an observation into a new array, because an environment may reuse its array in every step."""
        older = np.moveaxis(self._stacked, self._axis, 0)[self._width :]
        newest = np.moveaxis(np.asarray(observation, self._stacked.dtype), self._axis, 0)
        self._stacked = np.moveaxis(np.concatenate((older, newest)), 0, self._axis)
        return self._stacked.copy()


def _has_channels_first(space: spaces.Box) -> bool:
    """Return whether Stable-Baselines3 recognizes a space as an image with channels first."""
    is_image = (
        len(space.shape) == _AXES_OF_AN_IMAGE
        and space.dtype == np.uint8
        and bool(np.all(space.low == 0) and np.all(space.high == _BRIGHTEST))
    )
    return is_image and int(np.argmin(space.shape)) == 0
