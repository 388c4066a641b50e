"""Support for buffer classes of a job's author, which extend a buffer of Stable-Baselines3.

In Python's method resolution order, the author's class comes after the buffer for valid rows. So the method
`add` of the author's class gets one valid row at a time. In a rollout buffer, returns are computed as if the
rollout was truncated before each invalid row.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, cast

import numpy as np
import torch
from gymnasium import spaces
from sb3_contrib.common.maskable.buffers import MaskableDictRolloutBuffer, MaskableRolloutBuffer
from stable_baselines3.common.buffers import (
    BaseBuffer,
    DictReplayBuffer,
    DictRolloutBuffer,
    NStepReplayBuffer,
    ReplayBuffer,
    RolloutBuffer,
)
from stable_baselines3.her import HerReplayBuffer

from palaestra_trainer.algorithms.buffers import (
    ValidDictReplayBuffer,
    ValidDictRolloutBuffer,
    ValidReplayBuffer,
    ValidRolloutBuffer,
)
from palaestra_trainer.algorithms.hyperparameters import FIELD
from palaestra_trainer.algorithms.maskable import ValidMaskableDictRolloutBuffer, ValidMaskableRolloutBuffer
from palaestra_trainer.errors import ConfigurationError, fact_of

# For each rollout buffer on the left, the subclass for valid rows is on the right. Subclasses come before the
# classes that they extend.
VALID_ROLLOUTS: Mapping[type[Any], type[Any]] = {
    MaskableDictRolloutBuffer: ValidMaskableDictRolloutBuffer,
    MaskableRolloutBuffer: ValidMaskableRolloutBuffer,
    DictRolloutBuffer: ValidDictRolloutBuffer,
    RolloutBuffer: ValidRolloutBuffer,
}
# The buffer class of a job's author may extend a class on the left. The class on the right is the subclass of
# that class for valid rows.
_VALID: Mapping[type[Any], type[Any]] = {
    DictReplayBuffer: ValidDictReplayBuffer,
    ReplayBuffer: ValidReplayBuffer,
    **VALID_ROLLOUTS,
}
# These classes also sample the rows that follow a sampled row. If the members share one column, the next row
# may belong to another member.
_NEIGHBOURS = (HerReplayBuffer, NStepReplayBuffer)
_STATE_METHODS = ("state_dict", "load_state_dict")


class OwnBuffer(BaseBuffer):
    """The base of the subclass that a run uses instead of an author's buffer.

    This class returns the state that the author's class adds, for checkpoints.

    If the class has the methods `state_dict` and `load_state_dict`, this state is the result of `state_dict`.
    Otherwise this state is every attribute that the class adds.

    Raises:
        ConfigurationError: a checkpoint cannot hold one of these attributes.
    """

    # The buffer for valid rows, such as `ValidReplayBuffer`. `with_valid_rows` makes a class that extends
    # this class and that buffer, and sets this attribute.
    _rows_only: type[BaseBuffer]

    def __init__(
        self,
        buffer_size: int,
        observation_space: spaces.Space[Any],
        action_space: spaces.Space[Any],
        *args: Any,
        **options: Any,
    ) -> None:
        super().__init__(buffer_size, observation_space, action_space, *args, **options)
        self._not_kept = {*vars(self._rows_only(1, observation_space, action_space)), "_not_kept"}
        self.own_state()

    def own_state(self) -> dict[str, Any]:
        """Return the state that the author's class adds, by name: arrays, tensors, and JSON values.

        Raises:
            ConfigurationError: a value has another type, or the author's `state_dict` failed.
        """
        state = self._own_state()
        for name, value in state.items():
            if not _can_be_written(value):
                raise ConfigurationError(
                    f"{field_of(type(self))}: {type(self).__name__} has {name}, a {type(value).__name__}, "
                    "which a checkpoint cannot store; use arrays, tensors and numbers, or give the class "
                    "state_dict() and load_state_dict()"
                )
        return state

    def put_own_state(self, state: Mapping[str, Any]) -> None:
        """Restore the state that `own_state` returned.

        Raises:
            ConfigurationError: the author's `load_state_dict` failed.
        """
        if _has_state_methods(self):
            with _reported(type(self), "load_state_dict"):
                cast("Any", self).load_state_dict(dict(state))
            return
        for name, value in state.items():
            setattr(self, name, value)

    def keep(self, kept: np.ndarray) -> None:
        """Refuse to drop rows, because only the author's class knows which of its state belongs to a row.

        Raises:
            ConfigurationError: always.
        """
        raise ConfigurationError(
            f"{field_of(type(self))}: the checkpoint has lost {np.count_nonzero(~kept)} rows, but only the "
            f"code of {type(self).__name__} could remove its own data for these rows; restore the run "
            "directory from a copy, or begin a new run"
        )

    def _own_state(self) -> dict[str, Any]:
        if _has_state_methods(self):
            with _reported(type(self), "state_dict"):
                return dict(cast("Any", self).state_dict())
        return {name: value for name, value in vars(self).items() if name not in self._not_kept}


def field_of(cls: type[BaseBuffer]) -> str:
    """Return the field of a job that names a buffer of this class."""
    return f"{FIELD}.{'replay' if issubclass(cls, ReplayBuffer) else 'rollout'}_buffer_class"


def of_valid_rows(cls: Any) -> Any:
    """Return `cls` if it is a buffer for valid rows, or else its subclass from `with_valid_rows`."""
    return cls if issubclass(cls, ValidReplayBuffer | ValidRolloutBuffer) else with_valid_rows(cls)


def with_valid_rows(named: type[BaseBuffer]) -> type[BaseBuffer]:
    """Return a subclass of an author's buffer that stores or samples only valid rows, with the same name.

    Raises:
        ConfigurationError: samples of this buffer would contain invalid rows, or rows of another episode.
    """
    if issubclass(named, _NEIGHBOURS):
        raise ConfigurationError(
            f"{field_of(named)}: {named.__name__} takes the following row as the next step of the same "
            "episode, but here the rows of several simulators alternate; extend ReplayBuffer, or use "
            "HerReplayBuffer by its name"
        )
    base = next((base for base in _VALID if issubclass(named, base)), None)
    if base is None or getattr(named, "get", None) is not getattr(base, "get", None):
        raise ConfigurationError(
            f"{field_of(named)}: {named.__name__} overrides get, so its batches may contain rows that a "
            "fault made invalid; override compute_returns_and_advantage, add or _get_samples instead"
        )
    content = {"__doc__": named.__doc__, "__module__": named.__module__, "_rows_only": _VALID[base]}
    return cast("type[BaseBuffer]", type(named.__name__, (OwnBuffer, _VALID[base], named), content))


def refuse_other_observations(cls: type[BaseBuffer], observation: spaces.Space[Any]) -> None:
    """Check that a buffer accepts the observation.

    Raises:
        ConfigurationError: the observation is a Dict and the buffer does not take a Dict, or the reverse.
    """
    takes_dict = issubclass(cls, DictReplayBuffer | DictRolloutBuffer)
    if takes_dict == isinstance(observation, spaces.Dict):
        return
    kind = "Replay" if issubclass(cls, ReplayBuffer) else "Rollout"
    base = f"{kind}Buffer" if takes_dict else f"Dict{kind}Buffer"
    raise ConfigurationError(
        f"{field_of(cls)}: {cls.__name__} takes observations that are {'' if takes_dict else 'not '}a Dict, "
        f"unlike the environment's; extend {base} of Stable-Baselines3"
    )


@contextmanager
def _reported(cls: type[BaseBuffer], method: str) -> Iterator[None]:
    try:
        yield
    except Exception as error:  # the author's code may raise anything
        raise ConfigurationError(
            f"{field_of(cls)}: {cls.__name__}.{method} failed ({fact_of(error)}); correct it"
        ) from error


def _has_state_methods(buffer: BaseBuffer) -> bool:
    return all(callable(getattr(buffer, name, None)) for name in _STATE_METHODS)


def _can_be_written(value: Any) -> bool:
    """Return whether a checkpoint can write a value and read an equal value."""
    if isinstance(value, np.ndarray):
        return not value.dtype.hasobject
    # These values are not compared, because NaN is not equal to itself.
    if isinstance(value, torch.Tensor | float):
        return True
    try:
        return bool(json.loads(json.dumps(value)) == value)
    except (TypeError, ValueError):
        return False
