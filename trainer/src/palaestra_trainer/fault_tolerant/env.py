"""One member as a gymnasium wrapper that tolerates faults."""

from __future__ import annotations

from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec

from palaestra_trainer.fault_tolerant.env_group import EnvGroup
from palaestra_trainer.simulators.interface import Step


class FaultTolerantEnv(gymnasium.Wrapper[Any, Any, Any, Any]):
    """The environment of one simulator; a fault truncates the episode, the next reset waits for the restart.

    As with other wrappers of gymnasium, `unwrapped` is the environment itself, and `get_wrapper_attr` finds
    its attributes and methods.

    Args:
        players: a group of one member.

    Attributes:
        env: the environment of the episode; another object after a standby took over.
    """

    def __init__(self, players: EnvGroup) -> None:
        self._players = players
        [self._player] = players.all
        self._spec: EnvSpec | None = None
        super().__init__(self._player.env)

    @property
    def spec(self) -> EnvSpec | None:
        """None unless it was set, because a second environment with this robot cannot be created from a spec.

        The spec of the environment itself is `unwrapped.spec`.
        """
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = spec

    def set_wrapper_attr(self, name: str, value: Any, *, force: bool = True) -> bool:
        """Set an attribute where it is defined, else in this wrapper if `force`; return whether it was set.

        An attribute of the environment is set again after a restart and after a standby took over.
        """
        if hasattr(self, name) or not self.env.has_wrapper_attr(name):
            return super().set_wrapper_attr(name, value, force=force)
        self._player.restarter.set_attribute(name, value)
        return True

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; return its first observation and info. Waits until the simulator is restarted.

        Raises:
            As `EnvGroup.begin`.
        """
        self._players.begin([seed], [options])
        self.env = self._player.env
        return self._player.observation, self._player.reset_info

    def step(self, action: Any) -> Step:
        """Return the result of the environment's step; after a fault, the last observation, truncated.

        Raises:
            As `EnvGroup.step`.
        """
        return self._players.step(action).step

    def close(self) -> None:
        """Stop the simulator and release it; safe to repeat."""
        self._players.close()
