"""A base class for fakes that crash at given steps, as a simulator may do."""

from __future__ import annotations

from collections.abc import Collection

from palaestra_trainer.errors import SimulatorDead


class Crashing:
    """A fake that crashes at given steps, and works again after `restart`.

    Args:
        deaths: numbers of the steps at which the fake crashes, counted from 1; a restart does not reset the
            count.
        name: name of the fake in faults.
    """

    def __init__(self, deaths: Collection[int], name: str) -> None:
        self._deaths = frozenset(deaths)
        self._name = name
        self._steps = 0
        self._dead = False

    def restart(self) -> None:
        """Make the fake work again after a crash."""
        self._dead = False

    def _live_a_step(self) -> None:
        """Count a step, and crash if its number is in `deaths`.

        Raises:
            SimulatorDead: the fake has crashed in this step, or earlier without a restart.
        """
        self._live()
        self._steps += 1
        self._dead = self._steps in self._deaths
        self._live()

    def _live(self) -> None:
        """Check that the fake has not crashed.

        Raises:
            SimulatorDead: the fake has crashed.
        """
        if self._dead:
            raise SimulatorDead(self._name, f"died at step {self._steps}; restart it")
