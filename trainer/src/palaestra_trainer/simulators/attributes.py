"""Attributes that a program sets on an environment, as curricula do."""

from __future__ import annotations

from typing import Any

from palaestra_trainer.copies import copied
from palaestra_trainer.simulators.interface import Environment


class Attributes:
    """The attributes that a program has set on a member's environment; a standby gets them too.

    An environment gets each value once, so what it makes of it later stays.
    """

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}
        self._waiting: set[str] = set()
        self._given_to: Environment | None = None

    def set(self, name: str, value: Any, env: Environment | None) -> None:
        """Set an attribute now; without an environment, once the next episode begins."""
        self._values[name] = copied(value)
        self._waiting.add(name)
        if env is not None:
            self.give(env)

    def give(self, env: Environment) -> None:
        """Set on the environment of the next episode those that it has not got."""
        for name in self._waiting if env is self._given_to else self._values:
            _put(env, name, copied(self._values[name]))
        self._waiting.clear()
        self._given_to = env


def _put(env: Environment, name: str, value: Any) -> None:
    """Set an attribute where it is defined, in a wrapper or in the environment, else in the environment."""
    if not env.set_wrapper_attr(name, value, force=False):
        setattr(env.unwrapped, name, value)
