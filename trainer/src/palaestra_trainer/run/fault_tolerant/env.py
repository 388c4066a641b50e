"""A gymnasium wrapper around the environment of one member; it tolerates faults of the simulator."""

from __future__ import annotations

from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec

from palaestra_trainer.run.fault_tolerant.env_group import EnvGroup
from palaestra_trainer.simulators.interface import Step


class FaultTolerantEnv(gymnasium.Wrapper[Any, Any, Any, Any]):
    """The environment of one simulator; a fault truncates the episode.

    The `reset` after a fault waits until the simulator is restarted. As with other wrappers of gymnasium,
    `unwrapped` is the environment itself, and `get_wrapper_attr` finds its attributes and methods.

    Args:
        players: a group of one member.

    Attributes:
        env: the environment of the current episode; after a takeover by a standby, it is another object.
    """

    def __init__(self, players: EnvGroup) -> None:
        self._players = players
        [self._player] = players.all
        self._spec: EnvSpec | None = None
        super().__init__(self._player.env)

    @property
    def spec(self) -> EnvSpec | None:
        """The spec that a program set, else None; a second environment cannot be created from a spec.

        A spec would have to contain this robot, which only one environment can use. The spec of the inner
        environment is `unwrapped.spec`.
        """
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = spec

    def set_wrapper_attr(self, name: str, value: Any, *, force: bool = True) -> bool:
        """Set an attribute of the environment, or else of this wrapper; return whether it was set.

        If no object has the attribute, it is set on this wrapper only if `force` is True. An attribute of the
        environment is set again after a restart, and after a standby took over.
        """
        if hasattr(self, name) or not self.env.has_wrapper_attr(name):
            return super().set_wrapper_attr(name, value, force=force)
        self._player.restarter.set_attribute(name, value)
        return True

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Wait until the simulator is up, and begin an episode; return its first observation and info.

        Raises:
            The same errors as `EnvGroup.begin`.
        """
        self._players.begin([seed], [options])
        self.env = self._player.env
        return self._player.observation, self._player.reset_info

    def step(self, action: Any) -> Step:
        """Return the result of the environment's step; after a fault, return a truncated row.

        Raises:
            The same errors as `EnvGroup.step`.
        """
        return self._players.step(action).step

    def close(self) -> None:
        """Stop the simulator and release it; further calls have no effect."""
        self._players.close()
