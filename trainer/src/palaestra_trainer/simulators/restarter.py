"""Keeping one simulator going.

A `Restarter` looks after one member: it starts it, mends it after a fault within
its budget, recycles it between episodes and lets it rest. Starting and mending
take seconds, so they happen in a thread of the keeper's own: while that works,
the keeper is `busy` and nobody else touches the member. Which seed an episode
gets, and what a fault means for learning, is decided elsewhere.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from functools import partial
from typing import Any

import numpy as np
import structlog

from palaestra_protocol.pod.status import Cause
from palaestra_trainer.copies import copied
from palaestra_trainer.environments.masks import mask_of
from palaestra_trainer.errors import (
    ConfigurationError,
    FaultBudgetSpent,
    SimulatorFault,
    SimulatorRefused,
    WorldMisfit,
    WrongData,
)
from palaestra_trainer.simulators.attributes import Attributes
from palaestra_trainer.simulators.budget import Group, RestartBudget, RestartLimit
from palaestra_trainer.simulators.finite_check import check_observation, check_reward
from palaestra_trainer.simulators.interface import Member, NullWatcher, Step, Watcher
from palaestra_trainer.simulators.stats import SimulatorStats
from palaestra_trainer.simulators.threads import in_background
from palaestra_trainer.waiting.greenlets import away_s, let_others
from palaestra_trainer.waiting.signals import Check, go_on

log = structlog.get_logger(__name__)

LOOK_EVERY_S = 0.1
# A canceled try ends at once, unless it waits for a program that does not answer.
SETTLE_S = 10.0
# A simulator that dies every two dozen resets is recycled every few seconds, all night.
LOG_RECYCLING_EVERY_S = 60.0


class Restarter:
    """Keeps one member playing: starts, steps, mending, recycling and rests.

    Attributes:
        member: the member it looks after; hands off while the keeper is `busy`.
        watcher: notified of every fault and restart.
        group: the simulators that the member is one of.
        tried: whether it has been tried to start the member.
        lost: whether the member was given up, since the others of its group are enough.
        stepped: whether the run has taken a step, with the worlds that it has.
        meter: counts what is played.
    """

    def __init__(
        self,
        member: Member,
        limit: RestartLimit | None = None,
        watcher: Watcher | None = None,
        clock: Callable[[], float] = time.monotonic,
        group: Group | None = None,
    ) -> None:
        self.member = member
        self.watcher: Watcher = watcher or NullWatcher()
        self.group = group or Group()
        self.tried = self.lost = self.stepped = False
        self._refusal = ""  # how the last process showed a mistake of the configuration
        self._budget = RestartBudget(member.name, limit or RestartLimit(), clock)
        self._clock = clock
        self._recycled, self._log_next = 0, -math.inf
        self.meter = SimulatorStats(member, self._budget)
        self._attributes = Attributes()
        self._work: Future[None] | None = None
        self._abandoned = False
        self._recycles_resting = False

    @property
    def name(self) -> str:
        """The member's name."""
        return self.member.name

    @property
    def under_way(self) -> Future[None] | None:
        """The work on the member in the keeper's own thread; None: there is none."""
        return None if self._work is None or self._work.done() else self._work

    @property
    def busy(self) -> bool:
        """Whether the member is being started, mended or recycled, in a thread that nobody may disturb."""
        return self.under_way is not None

    def up(self) -> bool:
        """Return whether the member is up, as far as is known: neither being mended nor lost.

        Raises:
            FaultBudgetSpent: it broke more often than its budget allows.
            ConfigurationError: before any step, two of its processes lacked what the environment needs, or
                refused it in the same words.
            MasterLost: it could not be mended without a ROS master.
            SimulatorFault: it could not be recycled; begin to mend it.
        """
        if self.busy:
            return False
        if self._work is not None:
            self._work.result()
            self._work = None
        return not self.lost

    def begin_start(self) -> None:
        """Begin to start the member, again after each fault; then it is up, or lost."""
        self._begin(self._start)

    def begin_mending(self, fault: SimulatorFault, steps_lost: int = 0) -> None:
        """Begin to restart the broken member until it is up, or lost.

        Args:
            fault: how it broke.
            steps_lost: environment steps of the episode that the fault cut.
        """
        self._report(fault, steps_lost)
        self._begin(partial(self._mend, fault))

    def abandon(self) -> None:
        """Begin no further try of the work that is under way; may be called from any thread."""
        self._abandoned = True

    def stop(self) -> None:
        """Stop the member, however it is; a mending that is under way is ended before."""
        settle([self])
        if self.busy:
            log.warning("simulator not stopped: it is still being mended", simulator=self.name)
        else:
            self._switch(self.member.stop)

    def reset(
        self, seed: int, options: dict[str, Any] | None = None, check: Check = go_on
    ) -> tuple[Any, dict[str, Any]]:
        """Return first observation and info of a new episode, in a recycled member if that is due.

        They are copies, as those of `step`: the environment may go on to write into its own.
        `check` is called every tenth of a second while the member is recycled; raises to wait no longer.

        Raises:
            SimulatorFault: it broke; begin to mend it.
            Diverged: the observation is not finite.
        """
        self._recycle_when_due(check)
        env = self.member.env
        self._attributes.give(env)
        observation, info = env.reset(seed=seed, options=copied(options))
        check_observation(self.name, env, observation)
        self.meter.resets += 1
        return copied(observation), copied(info)

    def step(self, action: Any) -> Step:
        """Return what the environment's step returns, all of it numbers that can be learned from.

        Observation and info are copies, and the environment gets a copy of the action.

        Raises:
            SimulatorFault: it broke; begin to mend it.
            Diverged: observation or reward is not finite.
        """
        began = time.perf_counter() - away_s()
        observation, reward, terminated, truncated, info = self.member.env.step(copied(action))
        seconds = time.perf_counter() - away_s() - began
        if self.meter.count_step(seconds):
            self.watcher.slow(self.name, seconds)
        check_observation(self.name, self.member.env, observation)
        check_reward(self.name, self.member.env, reward, info)
        return copied(observation), reward, terminated, truncated, copied(info)

    def action_mask(self) -> np.ndarray:
        """Return which actions the environment allows in the next step; shape (choices,), bool.

        Raises:
            SimulatorFault: it broke; begin to mend it.
            ConfigurationError: the environment returned no mask of its actions.
        """
        return mask_of(self.member.env)

    def set_attribute(self, name: str, value: Any) -> None:
        """Set an attribute of the member's environment, where it is defined, and of each that follows it.

        While the keeper is busy, it is set when the next episode begins.
        """
        self._attributes.set(name, value, None if self.busy else self.member.env)

    def pause(self) -> None:
        """Let the member rest; a broken one is found by the next step that needs it."""
        self._switch(self.member.pause)

    def recycle_resting(self, episodes: int) -> None:
        """Begin to recycle the resting member if it is due before or amid the next `episodes`."""
        if self.up() and (reason := self.member.due(episodes)):
            self._log_recycling(reason)
            self._recycles_resting = True
            self._begin(self._recycle_resting)

    def unpause(self, check: Check = go_on) -> None:
        """End the rest; a broken member is found by the next step that needs it.

        Waits for a recycling that began during the rest. If that fails, mending begins.
        `check` is called every tenth of a second meanwhile; raises to wait no longer.
        """
        if self._recycles_resting:
            self._recycles_resting = False
            try:
                self._await_recycling(check)
            except SimulatorFault as fault:
                self.begin_mending(fault)
        self._switch(self.member.unpause)

    def _begin(self, work: Callable[[], None]) -> None:
        self._abandoned = False
        self._work = in_background(work, f"keeper-{self.name}")

    def _start(self) -> None:
        try:
            self.member.start()
        except SimulatorFault as fault:
            self._report(fault)
            self.tried = True
            self._mend(fault)
        else:
            self.tried = True
            self.watcher.started(self.name)

    def _mend(self, fault: SimulatorFault) -> None:
        while self._may_restart(fault):
            try:
                self.member.restart()
            except SimulatorFault as again:
                fault = again
                self._report(fault)
            else:
                self.watcher.restarted(self.name, recycled=False)
                return

    def _may_restart(self, fault: SimulatorFault) -> bool:
        if self._abandoned:
            raise FaultBudgetSpent(f"{self.name}: was abandoned ({fault}); start the run again") from fault
        self._judge(fault)
        try:
            self._budget.spend(fault)
        except FaultBudgetSpent as spent:
            if not self.group.lose_one():
                raise
            self._lose(spent)
            return False
        if self._budget.flapping:
            self.watcher.flapping(self.name)
        return True

    def _judge(self, fault: SimulatorFault) -> None:
        """Raise ConfigurationError if the second process in a row shows the same mistake, before any step."""
        before, self._refusal = self._refusal, self._refusal_of(fault)
        if before and before == self._refusal:
            raise ConfigurationError(f"{self.name}: {fault}") from fault

    def _refusal_of(self, fault: SimulatorFault) -> str:
        """Return what a fault of another process must be equal to, to show a mistake; "" if it shows none."""
        if isinstance(fault, WorldMisfit):
            return "" if self.stepped else WorldMisfit.__name__
        refused = isinstance(fault, WrongData | SimulatorRefused)
        return str(fault) if refused and not self.meter.stepped else ""

    def _lose(self, spent: FaultBudgetSpent) -> None:
        log.error("simulator given up: the others go on", simulator=self.name, fact=str(spent))
        self.lost = True
        self.watcher.given_up(self.name)
        with contextlib.suppress(SimulatorFault):
            self.member.stop()

    def _report(self, fault: SimulatorFault, steps_lost: int = 0) -> None:
        self.watcher.fault(self.name, fault, steps_lost)
        log.warning("simulator fault", simulator=self.name, kind=fault.kind, fact=str(fault))

    def _switch(self, switch: Callable[[], None]) -> None:
        if self.busy or self.lost:
            return
        try:
            switch()
        except SimulatorFault as fault:
            log.warning("simulator does not answer", simulator=self.name, fact=str(fault))

    def _recycle_when_due(self, check: Check) -> None:
        reason = self.member.due()
        if reason is None:
            return
        self._log_recycling(reason)
        self._begin(self._recycle)
        self._await_recycling(check)

    def _await_recycling(self, check: Check) -> None:
        while not self.up():
            let_others()
            with self.watcher.spending(Cause.RECYCLING):
                await_one([self], check)

    def _log_recycling(self, reason: str) -> None:
        """Log the first time, then one line a minute at most, with the number of all times."""
        self._recycled += 1
        if self._clock() >= self._log_next:
            log.info("simulator recycled", simulator=self.name, times=self._recycled, reason=reason)
            self._log_next = self._clock() + LOG_RECYCLING_EVERY_S

    def _recycle(self) -> None:
        self.member.restart()
        self.watcher.restarted(self.name, recycled=True)

    def _recycle_resting(self) -> None:
        self._recycle()
        self.member.pause()


def await_one(keepers: Sequence[Restarter], check: Check = go_on) -> None:
    """Return when one of the busy keepers is busy no more; at once if none is busy.

    Args:
        keepers: some of them may be ready or lost.
        check: called every tenth of a second; raises to wait no longer.
    """
    works = _under_way(keepers)
    while works and not wait(works, LOOK_EVERY_S, FIRST_COMPLETED).done:
        check()


def settle(keepers: Sequence[Restarter]) -> None:
    """End what goes on in the keepers' threads: no further tries, and those under way fail.

    Waits `SETTLE_S` seconds at most, and as long as the request to one that does not answer takes.
    """
    for keeper in keepers:
        keeper.abandon()
    give_up = time.monotonic() + SETTLE_S
    while (busy := [keeper for keeper in keepers if keeper.busy]) and time.monotonic() < give_up:
        for keeper in busy:
            if time.monotonic() < give_up:
                keeper.member.abandon()
        wait(_under_way(busy), LOOK_EVERY_S)


def _under_way(keepers: Sequence[Restarter]) -> list[Future[None]]:
    return [work for keeper in keepers if (work := keeper.under_way) is not None]
