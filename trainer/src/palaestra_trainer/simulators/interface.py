"""The interface of a simulator for the training loop, and of an object that receives its events.

A `Member` is a simulator with its environment. A `Watcher` receives the faults and restarts of members.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any, Protocol, runtime_checkable

import gymnasium

from palaestra_protocol.pod.status import Cause
from palaestra_protocol.scene import SceneState, VisibleScene
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
        """The environment, whose `step` and `reset` may raise `SimulatorFault`."""
        ...

    def due(self, episodes: int = 1) -> str | None:
        """Return the reason to recycle the simulator before the next `episodes`, as text; None: no reason."""
        ...

    def start(self) -> None:
        """Start the simulator; raise `SimulatorFault` if it does not start in time."""
        ...

    def stop(self) -> None:
        """Stop the simulator, in any state."""
        ...

    def restart(self) -> None:
        """Stop the simulator, in any state, and start it; raise `SimulatorFault` if the start fails."""
        ...

    def abandon(self) -> None:
        """Make a start or restart in another thread fail soon; do nothing if no start is running."""
        ...

    def pause(self) -> None:
        """Pause the simulator, which then uses no processor time until `unpause`."""
        ...

    def unpause(self) -> None:
        """End the pause."""
        ...


@runtime_checkable
class Spared(Protocol):
    """A member with a standby; the standby is a second simulator that can take over."""

    def spare(self) -> str | None:
        """Return a value of `StandbyState`; None if no standby can take over, now or soon."""
        ...


@runtime_checkable
class Reloadable(Protocol):
    """A member whose simulator can load its world again between two episodes."""

    def reload_due(self) -> bool:
        """Return whether the simulator must load its world again before the next episode."""
        ...

    def reload(self) -> None:
        """Load the world again, so that the simulator can step; raise `SimulatorFault` if that fails."""
        ...


@runtime_checkable
class ReportsLeftOut(Protocol):
    """A member whose simulator reports the parts of its world that it does not simulate."""

    def left_out(self) -> tuple[str, ...]:
        """Return the parts of its world that the simulator left out at its last start, as lines of text.

        The result is empty before the first start. This method never blocks.
        """
        ...


@runtime_checkable
class Located(Protocol):
    """A member whose robot and target can be recorded from above."""

    def sight(self) -> Sight | None:
        """Return the positions of robot and target after the last step, without a request to the simulator.

        The result is None if the robot does not drive on a floor.
        """
        ...


@runtime_checkable
class Viewed(Protocol):
    """A member whose simulator can describe its visible world; each method sends a request to it."""

    def visible_scene(self) -> VisibleScene | None:
        """Return the visible shapes of the world; None: the simulator, such as Webots, cannot list them."""
        ...

    def visible_state(self) -> SceneState:
        """Return the poses after the last step, for a scene that `visible_scene` returned before."""
        ...


class Watcher(Protocol):
    """Receives the events of simulators, in the thread in which they occur."""

    def stepped(self, steps: int) -> None:
        """Receive the number of environment steps that were just taken."""
        ...

    def fault(self, simulator: str, fault: SimulatorFault, steps_lost: int, *, restarts: bool = True) -> None:
        """Receive the fault of a simulator; the fault truncates an episode after `steps_lost` steps.

        Without `restarts`, the simulator goes on: only one of its copies has failed.
        """
        ...

    def started(self, simulator: str) -> None:
        """Receive the name of a simulator that is up for the first time."""
        ...

    def restarted(self, simulator: str, *, recycled: bool) -> None:
        """Receive the name of a simulator that is up again, after a fault or after recycling."""
        ...

    def slow(self, simulator: str, seconds: float) -> None:
        """Receive the seconds of a step that took much longer than usual, which is not a fault."""
        ...

    def flapping(self, simulator: str) -> None:
        """Receive the name of a simulator that is restarted again after several restarts in a short time."""
        ...

    def given_up(self, simulator: str) -> None:
        """Receive the name of a simulator that failed too often; the run continues without this simulator."""
        ...

    def spending(self, cause: Cause) -> AbstractContextManager[None]:
        """Count the training thread's time in the context under `cause`; do not call `let_others` inside."""
        ...


class NullWatcher:
    """A watcher that ignores all events."""

    def stepped(self, steps: int) -> None:
        """Ignore the event."""

    def fault(self, simulator: str, fault: SimulatorFault, steps_lost: int, *, restarts: bool = True) -> None:
        """Ignore the event."""

    def started(self, simulator: str) -> None:
        """Ignore the event."""

    def restarted(self, simulator: str, *, recycled: bool) -> None:
        """Ignore the event."""

    def slow(self, simulator: str, seconds: float) -> None:
        """Ignore the event."""

    def flapping(self, simulator: str) -> None:
        """Ignore the event."""

    def given_up(self, simulator: str) -> None:
        """Ignore the event."""

    def spending(self, cause: Cause) -> AbstractContextManager[None]:
        """Return a context that does nothing."""
        del cause
        return nullcontext()
