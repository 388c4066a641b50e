"""All simulators of a run, by role: started and stopped together, resting in turns."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from contextlib import contextmanager

import structlog

from palaestra_trainer.configuration import Configuration, SimulatorConfiguration
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.interruption import Check, go_on
from palaestra_trainer.simulators.background import in_background
from palaestra_trainer.simulators.budget import Care, Group
from palaestra_trainer.simulators.keeper import LOOK_EVERY_S, Keeper
from palaestra_trainer.simulators.member import Member, Watcher
from palaestra_trainer.simulators.meter import Meter

LONG_S = 5.0  # for simulators to come up; a line reports those that do not, then at twice the time each

log = structlog.get_logger(__name__)


class Fleet:
    """The keepers of all members of a configuration.

    Args:
        configuration: says how each member is looked after; found by its name.
        members: one for each simulator of the configuration.
        watcher: is told of every fault and restart.

    Attributes:
        collecting: keepers of the members that gather experience, in the configuration's order.
        evaluating: keepers of those that measure the policy; none if nothing is evaluated.
    """

    def __init__(self, configuration: Configuration, members: Sequence[Member], watcher: Watcher) -> None:
        by_name = {member.name: member for member in members}
        missing = [wanted.name for wanted in configuration.simulators if wanted.name not in by_name]
        if missing:
            raise ConfigurationError(f"simulators: {', '.join(missing)} cannot be made; list it")
        groups = groups_of(configuration)
        keepers = {
            wanted.name: Keeper(by_name[wanted.name], care_of(wanted), watcher, group=groups[wanted.group])
            for wanted in configuration.simulators
        }
        self.collecting = [keepers[wanted.name] for wanted in configuration.with_role("Collect")]
        self.evaluating = [keepers[wanted.name] for wanted in configuration.with_role("Evaluate")]
        self._all = [*self.collecting, *self.evaluating]

    def meters(self) -> dict[str, Meter]:
        """Return what counts for each member, by its name."""
        return {keeper.name: keeper.meter for keeper in self._all}

    def start(self, check: Check = go_on, *, stepped: bool = False) -> None:
        """Start all members at once; return when all have been tried, and enough of each group are up.

        Those that are not up yet go on being mended in the background.

        Args:
            check: called every tenth of a second; what it raises, such as `Interrupted`, waits for
                no member: a try that is under way may go on in its thread, and no other is begun.

            stepped: whether the run has taken steps before, so that its worlds were right.

        Raises:
            FaultBudgetSpent: too many of a group do not come up, however often it is tried.
            ConfigurationError: a world lacks what the environment needs; two processes of it said so.
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
                # Not until one is mended: that one of them has been tried may be enough as well.
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
            keeper.stepped = True  # from here on the others may step, whatever becomes of this one

    def stop(self) -> None:
        """Stop all members at once, however they are, also those that are being mended."""
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
def running(keepers: Sequence[Keeper]) -> Iterator[None]:
    """Run the members while inside, let them rest outside."""
    for keeper in keepers:
        keeper.run()
    try:
        yield
    finally:
        rest(keepers)


@contextmanager
def resting(keepers: Sequence[Keeper]) -> Iterator[None]:
    """Let the members rest while inside, run them outside."""
    rest(keepers)
    try:
        yield
    finally:
        for keeper in keepers:
            keeper.run()


def rest(keepers: Sequence[Keeper]) -> None:
    """Let the members rest."""
    for keeper in keepers:
        keeper.pause()


def groups_of(configuration: Configuration) -> dict[str, Group]:
    """Return the groups of a configuration's simulators by name."""
    sizes = Counter(simulator.group for simulator in configuration.simulators)
    return {it.group: Group(sizes[it.group], it.min_simulators) for it in configuration.simulators}


def care_of(simulator: SimulatorConfiguration) -> Care:
    """Return how the configuration wants one member to be looked after."""
    return Care(
        restart_limit=simulator.restart.limit,
        restart_within_s=simulator.restart.within_seconds,
    )
