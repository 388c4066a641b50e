"""What the training loop needs of a simulator, and whom it tells what happens to it.

A `Member` is one simulator with the environment that is played in it; a `Watcher` hears of its faults.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any, Protocol, runtime_checkable

import gymnasium

from palaestra_sim.protocol.status import Cause
from palaestra_trainer.errors import SimulatorFault

Environment = gymnasium.Env[Any, Any]
Step = tuple[Any, Any, bool, bool, dict[str, Any]]


class Member(Protocol):
    """One simulator and the environment that is played in it."""

    @property
    def name(self) -> str:
        """`<group>-<index>`, as in the configuration."""
        ...

    @property
    def env(self) -> Environment:
        """The environment; its `step` and `reset` may raise `SimulatorFault`."""
        ...

    def due(self) -> str | None:
        """Return why it ought to be recycled before the next episode, in words; None: no reason."""
        ...

    def start(self) -> None:
        """Start the simulator; `SimulatorFault` if it doesn't come up in time."""
        ...

    def stop(self) -> None:
        """Stop the simulator, however it is."""
        ...

    def restart(self) -> None:
        """Stop the simulator, however it is, and start it; `SimulatorFault` if it doesn't come."""
        ...

    def abandon(self) -> None:
        """Let a start or restart that is under way in another thread fail soon; harmless otherwise."""
        ...

    def pause(self) -> None:
        """Let the simulator rest: it uses no processor until `run`."""
        ...

    def run(self) -> None:
        """End the rest that `pause` began."""
        ...


@runtime_checkable
class Spared(Protocol):
    """A member in which a second simulator stands by to take the place of the first."""

    def spare(self) -> str | None:
        """Return one of `StandbyState`; None: nobody could take over, now or soon."""
        ...


class Watcher(Protocol):
    """Who is told what happens to simulators; called from the thread it happens in."""

    def stepped(self, steps: int) -> None:
        """`steps` environment steps were taken."""
        ...

    def fault(self, simulator: str, fault: SimulatorFault) -> None:
        """A simulator broke."""
        ...

    def started(self, simulator: str) -> None:
        """A simulator is up for the first time."""
        ...

    def restarted(self, simulator: str, *, recycled: bool) -> None:
        """A simulator is up again, after a fault or because it was recycled."""
        ...

    def slow(self, simulator: str, seconds: float) -> None:
        """A step took much longer than the simulator's steps usually do; that is no fault."""
        ...

    def flapping(self, simulator: str) -> None:
        """A simulator is being restarted, and has been again and again for some time."""
        ...

    def given_up(self, simulator: str) -> None:
        """A simulator broke too often and is not restarted; the others of its group are enough."""
        ...

    def spending(self, cause: Cause) -> AbstractContextManager[None]:
        """What training's thread does inside is spent on `cause`; no turn may end inside."""
        ...


class Nobody:
    """A watcher that listens to nothing."""

    def stepped(self, steps: int) -> None:
        """Ignore it."""

    def fault(self, simulator: str, fault: SimulatorFault) -> None:
        """Ignore it."""

    def started(self, simulator: str) -> None:
        """Ignore it."""

    def restarted(self, simulator: str, *, recycled: bool) -> None:
        """Ignore it."""

    def slow(self, simulator: str, seconds: float) -> None:
        """Ignore it."""

    def flapping(self, simulator: str) -> None:
        """Ignore it."""

    def given_up(self, simulator: str) -> None:
        """Ignore it."""

    def spending(self, cause: Cause) -> AbstractContextManager[None]:
        """Ignore it."""
        del cause
        return nullcontext()
