"""All simulators of a run, by role: started and stopped together, paused in turns."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from contextlib import contextmanager

import structlog

from palaestra_protocol.pod.enums import Role
from palaestra_trainer.configuration import Configuration, SimulatorConfiguration
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.simulators.budget import Group, RestartLimit
from palaestra_trainer.simulators.interface import Member, Watcher
from palaestra_trainer.simulators.restarter import LOOK_EVERY_S, Restarter
from palaestra_trainer.simulators.stats import SimulatorStats
from palaestra_trainer.simulators.threads import in_background
from palaestra_trainer.waiting.signals import Check, go_on

LONG_S = 5.0  # a start longer than this is logged with the missing simulators, again after each doubling

log = structlog.get_logger(__name__)


class Fleet:
    """The keepers of all members of a configuration.

    Args:
        configuration: has the settings of each member, found by its name.
        members: one for each simulator of the configuration.
        watcher: receives every fault and restart.

    Attributes:
        collecting: keepers of the members that gather experience, in the configuration's order.
        evaluating: keepers of the members that evaluate the policy; empty if nothing is evaluated.
    """

    def __init__(self, configuration: Configuration, members: Sequence[Member], watcher: Watcher) -> None:
        by_name = {member.name: member for member in members}
        missing = [wanted.name for wanted in configuration.simulators if wanted.name not in by_name]
        if missing:
            raise ConfigurationError(f"simulators: {', '.join(missing)} cannot be made; list it")
        groups = groups_of(configuration)
        keepers = {
            wanted.name: Restarter(
                by_name[wanted.name], limit_of(wanted), watcher, group=groups[wanted.group]
            )
            for wanted in configuration.simulators
        }
        self.collecting = [keepers[wanted.name] for wanted in configuration.with_role(Role.COLLECT)]
        self.evaluating = [keepers[wanted.name] for wanted in configuration.with_role(Role.EVALUATE)]
        self._all = [*self.collecting, *self.evaluating]

    def meters(self) -> dict[str, SimulatorStats]:
        """Return the counts of each member, by its name."""
        return {keeper.name: keeper.meter for keeper in self._all}

    def start(self, check: Check = go_on, *, stepped: bool = False) -> None:
        """Start all members at once; return when each was tried once and enough of each group are up.

        Members that are not up yet are still started in the background.

        Args:
            check: called every tenth of a second. What it raises, such as `Interrupted`, does not wait for
                members: a start that is under way may go on in its thread, and no other begins.
            stepped: whether the run has taken steps before, which shows that its worlds were right.

        Raises:
            FaultBudgetSpent: too many simulators of a group failed to start, within their budgets.
            ConfigurationError: a world lacks what the environment needs, as two processes of it showed.
        """
        check()
        for keeper in self._all:
            keeper.stepped = stepped
            keeper.begin_start()
        began, report_at_s = time.monotonic(), LONG_S
        try:
            while not self._enough():
                check()
                if (waited_s := time.monotonic() - began) >= report_at_s:
                    report_at_s = 2 * waited_s
                    log.info("waiting for simulators", names=self._down(), waited_s=round(waited_s))
                # Any finished work ends the wait: a first start that failed may be enough too.
                wait(
                    [work for keeper in self._all if (work := keeper.under_way)],
                    LOOK_EVERY_S,
                    FIRST_COMPLETED,
                )
        except BaseException:
            for keeper in self._all:
                keeper.abandon()
            raise
        for keeper in self._all:
            keeper.stepped = True  # from here on other members may step, even if this one still starts

    def stop(self) -> None:
        """Stop all members at once, in any state, also during a repair."""
        stops = [in_background(keeper.stop, f"stop-{keeper.name}") for keeper in self._all]
        wait(stops)
        for stop in stops:
            stop.result()

    def _down(self) -> list[str]:
        return [keeper.name for keeper in self._all if not keeper.up()]

    def _enough(self) -> bool:
        up = Counter(keeper.group for keeper in self._all if keeper.up())
        return all(keeper.tried and up[keeper.group] >= keeper.group.least for keeper in self._all)


@contextmanager
def running(keepers: Sequence[Restarter], check: Check = go_on) -> Iterator[None]:
    """Run the members inside the context, once their recycling is over; pause them outside."""
    for keeper in keepers:
        keeper.unpause(check)
    try:
        yield
    finally:
        rest(keepers)


@contextmanager
def resting(keepers: Sequence[Restarter]) -> Iterator[None]:
    """Pause the members inside the context, run them outside."""
    rest(keepers)
    try:
        yield
    finally:
        for keeper in keepers:
            keeper.unpause()


def rest(keepers: Sequence[Restarter]) -> None:
    """Pause the members."""
    for keeper in keepers:
        keeper.pause()


def groups_of(configuration: Configuration) -> dict[str, Group]:
    """Return the groups of a configuration's simulators, by name."""
    sizes = Counter(simulator.group for simulator in configuration.simulators)
    return {
        simulator.group: Group(sizes[simulator.group], simulator.min_simulators)
        for simulator in configuration.simulators
    }


def limit_of(simulator: SimulatorConfiguration) -> RestartLimit:
    """Return the restart limit of one member from the configuration."""
    return RestartLimit(
        restarts=simulator.restart.limit,
        within_s=simulator.restart.within_seconds,
    )
