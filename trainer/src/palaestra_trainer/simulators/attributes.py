"""Attributes that a program sets on an environment, as curricula do."""

from __future__ import annotations

from typing import Any

from palaestra_trainer.simulators.member import Environment


class Attributes:
    """The attributes that a program has set on a member's environment; a standby gets them too."""

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}
        self._given_to: Environment | None = None

    def set(self, name: str, value: Any, env: Environment | None) -> None:
        """Set an attribute now; without an environment, once the next episode begins."""
        self._values[name] = value
        if env is None:
            self._given_to = None
        else:
            _put(env, name, value)

    def give(self, env: Environment) -> None:
        """Set all of them on the environment of the next episode, if it has not got them."""
        if self._given_to is not env:
            for name, value in self._values.items():
                _put(env, name, value)
            self._given_to = env


def _put(env: Environment, name: str, value: Any) -> None:
    """Set an attribute where it is defined, in a wrapper or in the environment, else in the environment."""
    if not env.set_wrapper_attr(name, value, force=False):
        setattr(env.unwrapped, name, value)
