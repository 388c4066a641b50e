"""Start one simulator and restart it after faults.

A `Restarter` owns one member. It starts the member, restarts the member after a fault if the budget allows,
recycles the member between episodes, and pauses it. A start or restart takes seconds, so it runs in a thread
of the restarter. While that thread works, the restarter is `busy`, and other code must not use the member.
Other modules decide the seed of an episode and the effect of a fault on learning.
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
from palaestra_trainer.environments.copies import copied
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
from palaestra_trainer.simulators.interface import Member, NullWatcher, Reloadable, Step, Watcher
from palaestra_trainer.simulators.stats import SimulatorStats
from palaestra_trainer.simulators.threads import in_background
from palaestra_trainer.waiting.check import Check, go_on
from palaestra_trainer.waiting.greenlets import away_s, let_others

log = structlog.get_logger(__name__)

LOOK_EVERY_S = 0.1
# Longest wait for canceled starts. Usually they end at once; a start that waits for a program that does not
# respond takes longer.
SETTLE_S = 10.0
# A simulator that must be recycled after two dozen resets is recycled every few seconds. Logging each time
# would fill the log.
LOG_RECYCLING_EVERY_S = 60.0


class Restarter:
    """Starts, steps, restarts, recycles and pauses one member.

    Attributes:
        member: the member; do not use it while the restarter is `busy`.
        watcher: receives every fault and restart.
        group: the member's group of simulators.
        tried: whether the first start of the member has ended, successfully or not.
        lost: whether the member failed for good; the run continues, because its group is large enough.
        stepped: whether the run has taken a step, which proves that its worlds are right.
        meter: statistics of the member's steps and resets.
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
        # The mistake in the configuration that caused the fault of the last process; empty: no mistake.
        self._refusal = ""
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
        """The running start, restart or recycling of the member; None if the restarter's thread is idle."""
        return None if self._work is None or self._work.done() else self._work

    @property
    def busy(self) -> bool:
        """Whether the restarter's thread uses the member; do not use the member meanwhile."""
        return self.under_way is not None

    def up(self) -> bool:
        """Return whether the member is up, which means neither lost nor being restarted.

        Raises:
            FaultBudgetSpent: the member failed more often than its restart budget allows.
            ConfigurationError: before the first step, two processes in a row lacked a device that the
                environment needs, or failed with the same message.
            MasterLost: the member could not be restarted, because no ROS master responds.
            SimulatorFault: the recycling of the member failed; call `begin_restart`.
        """
        if self.busy:
            return False
        if self._work is not None:
            self._work.result()
            self._work = None
        return not self.lost

    def begin_start(self) -> None:
        """Begin to start the member; repeat the start after each fault until the member is up or lost."""
        self._begin(self._start)

    def begin_restart(self, fault: SimulatorFault, steps_lost: int = 0) -> None:
        """Begin to restart the member after a fault; repeat the restart until the member is up or lost.

        Args:
            fault: the fault that was detected: which simulator failed, and how.
            steps_lost: environment steps of the episode that the fault truncated.
        """
        self._report(fault, steps_lost)
        self._begin(partial(self._restart, fault))

    def abandon(self) -> None:
        """Do not begin another restart after the current restart; any thread may call this method."""
        self._abandoned = True

    def stop(self) -> None:
        """Stop the member in any state; first cancel a running restart."""
        settle([self])
        if self.busy:
            log.warning("simulator not stopped, because its restart has not ended", simulator=self.name)
        else:
            self._switch(self.member.stop)

    def reset(
        self, seed: int, options: dict[str, Any] | None = None, check: Check = go_on
    ) -> tuple[Any, dict[str, Any]]:
        """Recycle or reload the member if that is due; return first observation and info of a new episode.

        Observation and info are copies, as in `step`, because the environment may write into its own objects
        later. `check` is called every tenth of a second during a recycling or a reload; it raises to end the
        wait.

        Raises:
            SimulatorFault: the member failed; call `begin_restart`.
            Diverged: the observation is not finite.
        """
        self._recycle_when_due(check)
        self._reload_when_due(check)
        self.give_attributes()
        env = self.member.env
        observation, info = env.reset(seed=seed, options=copied(options))
        check_observation(self.name, env, observation)
        self.meter.resets += 1
        return copied(observation), copied(info)

    def step(self, action: Any) -> Step:
        """Return the result of the environment's step, and check that observation and reward are finite.

        Observation and info are copies, and the environment gets a copy of the action.

        Raises:
            SimulatorFault: the member failed; call `begin_restart`.
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
        """Return the mask of allowed actions for the next step; shape (choices,), bool.

        Raises:
            SimulatorFault: the member failed; call `begin_restart`.
            ConfigurationError: the environment returned a value that is not a mask of its actions.
        """
        return mask_of(self.member.env)

    def set_attribute(self, name: str, value: Any) -> None:
        """Set an attribute of the member's environment and of each later environment of the member.

        If the restarter is busy, the attribute is set when the next episode begins.
        """
        self._attributes.set(name, value, None if self.busy else self.member.env)

    def give_attributes(self) -> None:
        """Set the attributes that the member's environment lacks; call it before an episode."""
        self._attributes.give(self.member.env)

    def pause(self) -> None:
        """Pause the member; if that fails, the next step reports the fault."""
        self._switch(self.member.pause)

    def recycle_resting(self, episodes: int) -> None:
        """Begin to recycle the paused member if a recycling would be due within the next `episodes`."""
        if self.up() and (reason := self.member.due(episodes)):
            self._log_recycling(reason)
            self._recycles_resting = True
            self._begin(self._recycle_resting)

    def unpause(self, check: Check = go_on) -> None:
        """End the pause; if that fails, the next step reports the fault.

        If a recycling began during the pause, wait for its end. If the recycling fails, a restart begins.
        `check` is called every tenth of a second during the wait; it raises to end the wait.
        """
        if self._recycles_resting:
            self._recycles_resting = False
            try:
                self._await_recycling(check)
            except SimulatorFault as fault:
                self.begin_restart(fault)
        self._switch(self.member.unpause)

    def _begin(self, work: Callable[[], None]) -> None:
        self._abandoned = False
        self._work = in_background(work, f"restarter-{self.name}")

    def _start(self) -> None:
        try:
            self.member.start()
        except SimulatorFault as fault:
            self._report(fault)
            self.tried = True
            self._restart(fault)
        else:
            self.tried = True
            self.watcher.started(self.name)

    def _restart(self, fault: SimulatorFault) -> None:
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
        """Raise ConfigurationError if two processes in a row show the same mistake before the first step."""
        before, self._refusal = self._refusal, self._refusal_of(fault)
        if before and before == self._refusal:
            raise ConfigurationError(f"{self.name}: {fault}") from fault

    def _refusal_of(self, fault: SimulatorFault) -> str:
        """Return the mistake that a fault shows, for a comparison with the mistake of the next process.

        The result is "" if the fault does not show a mistake in the configuration.
        """
        if isinstance(fault, WorldMisfit):
            return "" if self.stepped else WorldMisfit.__name__
        refused = isinstance(fault, WrongData | SimulatorRefused)
        return str(fault) if refused and not self.meter.stepped else ""

    def _lose(self, spent: FaultBudgetSpent) -> None:
        log.error(
            "simulator given up; training continues with the other simulators",
            simulator=self.name,
            fact=str(spent),
        )
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
            log.warning("simulator does not respond", simulator=self.name, fact=str(fault))

    def _recycle_when_due(self, check: Check) -> None:
        reason = self.member.due()
        if reason is None:
            return
        self._log_recycling(reason)
        self._begin(self._recycle)
        self._await_recycling(check)

    def _reload_when_due(self, check: Check) -> None:
        if isinstance(self.member, Reloadable) and self.member.reload_due():
            self._begin(self.member.reload)
            self._await_recycling(check)

    def _await_recycling(self, check: Check) -> None:
        while not self.up():
            let_others()
            with self.watcher.spending(Cause.RECYCLING):
                await_one([self], check)

    def _log_recycling(self, reason: str) -> None:
        """Log the first recycling, and then at most one line per minute with the number of recyclings."""
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


def await_one(restarters: Sequence[Restarter], check: Check = go_on) -> None:
    """Wait until one of the busy restarters is no longer busy; return at once if all are idle.

    Args:
        restarters: the restarters; some may be idle or lost.
        check: a function that is called every tenth of a second, and raises to end the wait.
    """
    works = _under_way(restarters)
    while works and not wait(works, LOOK_EVERY_S, FIRST_COMPLETED).done:
        check()


def settle(restarters: Sequence[Restarter]) -> None:
    """End the work of the restarters' threads: make running starts fail, and begin no new start.

    This function waits at most `SETTLE_S` seconds, plus the timeout of one request to a program that does not
    respond.
    """
    for restarter in restarters:
        restarter.abandon()
    give_up = time.monotonic() + SETTLE_S
    while (busy := [restarter for restarter in restarters if restarter.busy]) and time.monotonic() < give_up:
        for restarter in busy:
            if time.monotonic() < give_up:
                restarter.member.abandon()
        wait(_under_way(busy), LOOK_EVERY_S)


def _under_way(restarters: Sequence[Restarter]) -> list[Future[None]]:
    return [work for restarter in restarters if (work := restarter.under_way) is not None]
