"""Keep the attributes that a program sets on an environment, for example for a curriculum."""

from __future__ import annotations

from typing import Any

from palaestra_trainer.environments.copies import copied
from palaestra_trainer.simulators.interface import Environment


class Attributes:
    """The attributes that a program sets on a member's environment; a standby's environment gets them too.

    Each environment gets each value only once. So if the environment changes the value later, the change
    stays.
    """

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}
        self._waiting: set[str] = set()
        self._given_to: Environment | None = None

    def set(self, name: str, value: Any, env: Environment | None) -> None:
        """Set an attribute now; if `env` is None, set it when the next episode begins."""
        self._values[name] = copied(value)
        self._waiting.add(name)
        if env is not None:
            self.give(env)

    def give(self, env: Environment) -> None:
        """Set the attributes that the environment of the next episode has not received yet."""
        for name in self._waiting if env is self._given_to else self._values:
            _put(env, name, copied(self._values[name]))
        self._waiting.clear()
        self._given_to = env


def _put(env: Environment, name: str, value: Any) -> None:
    """Set an attribute on the wrapper that has it, or else on the innermost environment."""
    if not env.set_wrapper_attr(name, value, force=False):
        env.unwrapped.set_wrapper_attr(name, value)
