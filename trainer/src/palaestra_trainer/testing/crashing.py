"""A life that ends at given steps, as that of a simulator that crashes."""

from __future__ import annotations

from collections.abc import Collection

from palaestra_trainer.errors import SimulatorDead


class Crashing:
    """A thing that dies at some of its steps, and lives again after `restart`.

    Args:
        deaths: numbers of the steps, counted from 1 over its whole life, at which it dies.
        name: its name in faults.
    """

    def __init__(self, deaths: Collection[int], name: str) -> None:
        self._deaths = frozenset(deaths)
        self._name = name
        self._steps = 0
        self._dead = False

    def restart(self) -> None:
        """Bring it back to life."""
        self._dead = False

    def _live_a_step(self) -> None:
        """Count a step, which may be its last.

        Raises:
            SimulatorDead: it is dead.
        """
        self._live()
        self._steps += 1
        self._dead = self._steps in self._deaths
        self._live()

    def _live(self) -> None:
        """Return while it lives.

        Raises:
            SimulatorDead: it is dead.
        """
        if self._dead:
            raise SimulatorDead(self._name, f"died at step {self._steps}; restart it")
