"""The interface of a simulator for the training loop, and of an observer of simulators.

A `Member` is one simulator with its environment; a `Watcher` receives its faults.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any, Protocol, runtime_checkable

import gymnasium

from palaestra_protocol.pod.status import Cause
from palaestra_trainer.errors import SimulatorFault
from palaestra_trainer.robots.sight import Sight

Environment = gymnasium.Env[Any, Any]
Step = tuple[Any, Any, bool, bool, dict[str, Any]]


class Member(Protocol):
    """One simulator and its environment."""

    @property
    def name(self) -> str:
        """`<group>-<index>`, as in the configuration."""
        ...

    @property
    def env(self) -> Environment:
        """The environment; its `step` and `reset` may raise `SimulatorFault`."""
        ...

    def due(self, episodes: int = 1) -> str | None:
        """Return the reason to recycle it before the next `episodes`, as text; None: no reason."""
        ...

    def start(self) -> None:
        """Start the simulator; raise `SimulatorFault` if it does not start in time."""
        ...

    def stop(self) -> None:
        """Stop the simulator, in any state."""
        ...

    def restart(self) -> None:
        """Stop the simulator, in any state, and start it; raise `SimulatorFault` if that fails."""
        ...

    def abandon(self) -> None:
        """Make a start or restart in another thread fail soon; without one, do nothing."""
        ...

    def pause(self) -> None:
        """Pause the simulator: it uses no processor time until `unpause`."""
        ...

    def unpause(self) -> None:
        """End the pause."""
        ...


@runtime_checkable
class Spared(Protocol):
    """A member with a standby: a second simulator that can take the place of the first."""

    def spare(self) -> str | None:
        """Return one of `StandbyState`; None: no simulator can take over, now or soon."""
        ...


@runtime_checkable
class ReportsLeftOut(Protocol):
    """A member whose simulator reports what it leaves out of its world."""

    def left_out(self) -> tuple[str, ...]:
        """Return the parts of its world that the simulator left out at its last start, in lines for people.

        It is empty before the first start. Never blocks.
        """
        ...


@runtime_checkable
class Located(Protocol):
    """A member whose robot can be recorded from above."""

    def sight(self) -> Sight | None:
        """Return where robot and target are after the last step, without a request to the simulator.

        None: the robot does not drive on a floor.
        """
        ...


class Watcher(Protocol):
    """Receives the events of simulators; called from the thread in which they happen."""

    def stepped(self, steps: int) -> None:
        """`steps` environment steps were taken."""
        ...

    def fault(self, simulator: str, fault: SimulatorFault, steps_lost: int) -> None:
        """A simulator broke; its episode of `steps_lost` steps is truncated."""
        ...

    def started(self, simulator: str) -> None:
        """A simulator is up for the first time."""
        ...

    def restarted(self, simulator: str, *, recycled: bool) -> None:
        """A simulator is up again, after a fault or after recycling."""
        ...

    def slow(self, simulator: str, seconds: float) -> None:
        """A step took much longer than the simulator's usual steps; that is not a fault."""
        ...

    def flapping(self, simulator: str) -> None:
        """A simulator is being restarted, and has been restarted repeatedly for some time."""
        ...

    def given_up(self, simulator: str) -> None:
        """A simulator broke too often and is not restarted; the others of its group are enough."""
        ...

    def spending(self, cause: Cause) -> AbstractContextManager[None]:
        """Count the training thread's time inside the context under `cause`; no turn may end inside."""
        ...


class NullWatcher:
    """A watcher that ignores all events."""

    def stepped(self, steps: int) -> None:
        """Ignore it."""

    def fault(self, simulator: str, fault: SimulatorFault, steps_lost: int) -> None:
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
