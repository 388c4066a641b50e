"""A fake task with any pair of spaces, computed in this process, to test algorithms.

Observations and rewards depend only on the seed of the episode and on all its actions so far. So a run is
repeatable, and a resumed run that lost some of its state differs from the original run.
"""

from __future__ import annotations

import zlib
from collections.abc import Collection, Mapping
from copy import deepcopy
from types import MappingProxyType
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from palaestra_trainer.testing.crashing import Crashing

_IMAGE = spaces.Box(0, 255, (36, 36, 3), np.uint8)
_NUMBERS = spaces.Box(-1.0, 1.0, (3,), np.float32)
OBSERVATIONS: Mapping[str, spaces.Space[Any]] = MappingProxyType(
    {
        "Box": _NUMBERS,
        "Dict": spaces.Dict({"numbers": _NUMBERS, "place": spaces.Discrete(3)}),
        "image": _IMAGE,
        "Dict with image": spaces.Dict({"numbers": _NUMBERS, "view": _IMAGE}),
        "Discrete": spaces.Discrete(5),
        "MultiDiscrete": spaces.MultiDiscrete([3, 2]),
        "MultiBinary": spaces.MultiBinary(4),
        "Tuple": spaces.Tuple((_NUMBERS, spaces.Discrete(3))),
    }
)
ACTIONS: Mapping[str, spaces.Space[Any]] = MappingProxyType(
    {
        "Discrete": spaces.Discrete(3),
        "MultiDiscrete": spaces.MultiDiscrete([2, 3]),
        "MultiBinary": spaces.MultiBinary(2),
        "Box": spaces.Box(-1.0, 1.0, (2,), np.float32),
    }
)


class FakeTask(Crashing, gymnasium.Env[Any, Any]):
    """An environment with episodes of at most `max_steps` steps; each step draws a new observation.

    Args:
        observation_space: the space of observations; the task uses a copy.
        action_space: the space of actions; the task uses a copy.
        deaths: numbers of the steps at which the task crashes, counted from 1; a restart does not reset the
            count.
        max_steps: steps after which an episode is truncated.
    """

    def __init__(
        self,
        observation_space: spaces.Space[Any],
        action_space: spaces.Space[Any],
        deaths: Collection[int] = (),
        max_steps: int = 6,
    ) -> None:
        super().__init__(deaths, "fake")
        self.observation_space = deepcopy(observation_space)
        self.action_space = deepcopy(action_space)
        self._max_steps = max_steps
        self._past = 0
        self._length = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode that `seed` decides."""
        super().reset(seed=seed, options=options)
        self._live()
        self._past, self._length = zlib.crc32(repr(seed).encode()), 0
        return self._observe(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take a step; on average, one of nine steps terminates the episode."""
        self._live_a_step()
        self._length += 1
        self._past = zlib.crc32(np.ascontiguousarray(action).tobytes(), self._past)
        over = self._past % 9 == 0
        truncated = self._length >= self._max_steps and not over
        return self._observe(), self._past % 100 / 100, over, truncated, {"is_success": over}

    def _observe(self) -> Any:
        self.observation_space.seed(self._past)
        return self.observation_space.sample()


class MaskedTask(FakeTask):
    """A fake task that forbids some actions, depending on the previous actions of the episode.

    Raises:
        AssertionError: a forbidden action was given to `step`.
    """

    def action_masks(self) -> np.ndarray:
        """Return the mask of allowed choices for the next step, at least one per number of the action."""
        self._live()
        return self._allowed()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take a step; raise an error if the action is forbidden."""
        chosen = np.asarray(spaces.flatten(_numbers(self.action_space), action), np.bool_)
        if (chosen & ~self._allowed()).any():
            raise AssertionError(f"action {action} is not allowed by the mask in step {self._length + 1}")
        return super().step(action)

    def _allowed(self) -> np.ndarray:
        """Return a random mask, which allows at least one action."""
        numbers = _numbers(self.action_space)
        numbers.seed(self._past)
        allowed = np.asarray(spaces.flatten(numbers, numbers.sample()), np.bool_)
        return allowed | np.random.default_rng(self._past).integers(2, size=allowed.shape).astype(np.bool_)


def _numbers(space: spaces.Space[Any]) -> spaces.Space[Any]:
    """Return a copy of a space of actions that Gymnasium flattens to one value for each choice."""
    if isinstance(space, spaces.MultiBinary):
        return spaces.MultiDiscrete([2] * int(np.prod(space.shape)))
    return deepcopy(space)
