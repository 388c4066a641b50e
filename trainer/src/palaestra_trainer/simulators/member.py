"""What the training loop needs of a simulator, and how one is kept going.

A `Member` is one simulator with the environment that is played in it. A
`Keeper` looks after one member: it starts episodes in it, restarts it after a
fault within its budget, recycles it between episodes, and never lets a
`SimulatorFault` out. Which seed an episode gets, and what a fault means for
learning, is decided elsewhere.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Protocol

import gymnasium
import structlog

from palaestra_trainer.errors import FaultBudgetSpent, SimulatorFault

log = structlog.get_logger(__name__)

Environment = gymnasium.Env[Any, Any]


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

    @property
    def resets(self) -> int:
        """Resets since the simulator was last started."""
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

    def pause(self) -> None:
        """Let the simulator rest: it uses no processor until `run`."""
        ...

    def run(self) -> None:
        """End the rest that `pause` began."""
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Care:
    """How a member is looked after.

    Attributes:
        recycle_after_resets: restart it between episodes after so many resets; None: never.
        restart_limit: restarts after faults within any `restart_within_s` seconds.
    """

    recycle_after_resets: int | None = None
    restart_limit: int = 10
    restart_within_s: float = 600.0


@dataclass(slots=True)
class RestartBudget:
    """How many restarts one simulator has left, by a sliding window of time."""

    care: Care
    clock: Callable[[], float] = time.monotonic
    _spent: deque[float] = field(default_factory=deque)

    def spend(self, fault: SimulatorFault) -> None:
        """Take one restart.

        Raises:
            FaultBudgetSpent: `restart_limit` restarts lie within `restart_within_s` already.
        """
        now = self.clock()
        while self._spent and now - self._spent[0] >= self.care.restart_within_s:
            self._spent.popleft()
        if len(self._spent) >= self.care.restart_limit:
            raise FaultBudgetSpent(
                f"{fault.simulator}: {self.care.restart_limit} restarts within "
                f"{self.care.restart_within_s:g} s did not mend it ({fault}); "
                "read the simulator's log, or raise restart.limit"
            ) from fault
        self._spent.append(now)


class Keeper:
    """Keeps one member playing: resets, restarts, recycling and rests.

    Attributes:
        member: the member it looks after.
        watcher: is told of every fault and restart.
    """

    def __init__(
        self,
        member: Member,
        care: Care | None = None,
        watcher: Watcher | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.member = member
        self.watcher: Watcher = watcher or Nobody()
        self._care = care or Care()
        self._budget = RestartBudget(self._care, clock)
        self._given_up = False

    @property
    def name(self) -> str:
        """The member's name."""
        return self.member.name

    def start(self) -> None:
        """Start the member, again after each fault.

        Raises:
            FaultBudgetSpent: the member's budget of restarts is used up.
        """
        try:
            self.member.start()
        except SimulatorFault as fault:
            self.mend(fault)
        else:
            self.watcher.started(self.name)

    def stop(self) -> None:
        """Stop the member, however it is."""
        self._switch(self.member.stop)

    def reset(
        self, seeds: Iterator[int], options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Return first observation and info of a new episode, after as many restarts as it takes.

        Each try takes the next of `seeds`, which must not run dry.

        Raises:
            FaultBudgetSpent: the member's budget of restarts is used up.
        """
        self._recycle_when_due()
        while True:
            try:
                return self.member.env.reset(seed=next(seeds), options=options)
            except SimulatorFault as fault:
                self.mend(fault)

    def mend(self, fault: SimulatorFault) -> None:
        """Restart the broken member until it is up.

        Raises:
            FaultBudgetSpent: the member's budget of restarts is used up, or it was given up.
        """
        while True:
            self.watcher.fault(self.name, fault)
            log.warning("simulator fault", simulator=self.name, kind=fault.kind, fact=str(fault))
            if self._given_up:
                raise FaultBudgetSpent(f"{self.name}: was given up ({fault}); start the run again") from fault
            self._budget.spend(fault)
            try:
                self.member.restart()
            except SimulatorFault as again:
                fault = again
            else:
                self.watcher.restarted(self.name, recycled=False)
                return

    def give_up(self) -> None:
        """Begin no further try to mend the member; may be called from any thread."""
        self._given_up = True

    def pause(self) -> None:
        """Let the member rest; a broken one is found by the next step that needs it."""
        self._switch(self.member.pause)

    def run(self) -> None:
        """End the rest; a broken member is found by the next step that needs it."""
        self._switch(self.member.run)

    def _switch(self, switch: Callable[[], None]) -> None:
        try:
            switch()
        except SimulatorFault as fault:
            log.warning("simulator does not answer", simulator=self.name, fact=str(fault))

    def _recycle_when_due(self) -> None:
        limit = self._care.recycle_after_resets
        if limit is None or self.member.resets < limit:
            return
        try:
            self.member.restart()
        except SimulatorFault as fault:
            self.mend(fault)
        else:
            self.watcher.restarted(self.name, recycled=True)
