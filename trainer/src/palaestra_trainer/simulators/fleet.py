"""Start, stop and pause all simulators of a run, by role."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from contextlib import ExitStack, contextmanager

import structlog

from palaestra_protocol.pod.enums import Role
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Configuration
from palaestra_trainer.job.simulator_configuration import SimulatorConfiguration
from palaestra_trainer.simulators.budget import Group, RestartLimit
from palaestra_trainer.simulators.interface import Member, Watcher
from palaestra_trainer.simulators.restarter import LOOK_EVERY_S, Restarter
from palaestra_trainer.simulators.stats import SimulatorStats
from palaestra_trainer.simulators.threads import in_background
from palaestra_trainer.waiting.check import Check, go_on

# If the start takes longer, the missing simulators are logged. They are logged again each time the duration
# has doubled.
LONG_S = 5.0

log = structlog.get_logger(__name__)


class Fleet:
    """The restarters of all members of a configuration.

    Args:
        configuration: the configuration, with the settings of each member under its name.
        members: the member for each simulator of the configuration.
        watcher: receives every fault and restart.

    Attributes:
        collecting: restarters of the members that collect experience, in the configuration's order.
        evaluating: restarters of the members that evaluate the policy; empty without such members.
    """

    def __init__(self, configuration: Configuration, members: Sequence[Member], watcher: Watcher) -> None:
        by_name = {member.name: member for member in members}
        missing = [wanted.name for wanted in configuration.simulators if wanted.name not in by_name]
        if missing:
            raise ConfigurationError(
                f"simulators: {', '.join(missing)} has no member; add one of that name to members"
            )
        groups = groups_of(configuration)
        restarters = {
            wanted.name: Restarter(
                by_name[wanted.name], limit_of(wanted), watcher, group=groups[wanted.group]
            )
            for wanted in configuration.simulators
        }
        self.collecting = [restarters[wanted.name] for wanted in configuration.with_role(Role.COLLECT)]
        self.evaluating = [restarters[wanted.name] for wanted in configuration.with_role(Role.EVALUATE)]
        self._all = [*self.collecting, *self.evaluating]

    def meters(self) -> dict[str, SimulatorStats]:
        """Return the statistics of each member, by its name."""
        return {restarter.name: restarter.meter for restarter in self._all}

    def start(self, check: Check = go_on, *, stepped: bool = False) -> None:
        """Start all members at the same time; return when enough members of each group are up.

        Also wait until the first start of every member has ended. If a first start failed, it is repeated in
        the background.

        Args:
            check: called every tenth of a second. If `check` raises, for example `Interrupted`, this method
                raises the same error at once. A running start may then continue in its thread, but no new
                start begins.
            stepped: whether the run has already taken steps, which proves that its worlds are right.

        Raises:
            FaultBudgetSpent: too many simulators of a group failed to start, and their restart budgets are
                spent.
            ConfigurationError: two processes in a row showed that a world lacks a device or node that the
                environment needs.
        """
        check()
        for restarter in self._all:
            restarter.stepped = stepped
            restarter.begin_start()
        began, report_at_s = time.monotonic(), LONG_S
        with ExitStack() as undo:
            undo.callback(self._abandon_all)
            while not self._enough():
                check()
                if (waited_s := time.monotonic() - began) >= report_at_s:
                    report_at_s = 2 * waited_s
                    log.info("waiting for simulators", names=self._down(), waited_s=round(waited_s))
                # Every start that finishes ends the wait, even if it failed, because the group may still be
                # large enough.
                wait(
                    [work for restarter in self._all if (work := restarter.under_way)],
                    LOOK_EVERY_S,
                    FIRST_COMPLETED,
                )
            undo.pop_all()
        for restarter in self._all:
            restarter.stepped = True  # the run may step from now on, even while this member still starts

    def stop(self) -> None:
        """Stop all members at the same time, in any state, even during a restart."""
        stops = [in_background(restarter.stop, f"stop-{restarter.name}") for restarter in self._all]
        wait(stops)
        for stop in stops:
            stop.result()

    def _abandon_all(self) -> None:
        for restarter in self._all:
            restarter.abandon()

    def _down(self) -> list[str]:
        return [restarter.name for restarter in self._all if not restarter.up()]

    def _enough(self) -> bool:
        up = Counter(restarter.group for restarter in self._all if restarter.up())
        return all(
            restarter.tried and up[restarter.group] >= restarter.group.least for restarter in self._all
        )


@contextmanager
def running(restarters: Sequence[Restarter], check: Check = go_on) -> Iterator[None]:
    """Unpause the members for the context, after a pending recycling; pause them again afterwards."""
    for restarter in restarters:
        restarter.unpause(check)
    try:
        yield
    finally:
        rest(restarters)


@contextmanager
def resting(restarters: Sequence[Restarter]) -> Iterator[None]:
    """Pause the members for the context; unpause them afterwards."""
    rest(restarters)
    try:
        yield
    finally:
        for restarter in restarters:
            restarter.unpause()


def rest(restarters: Sequence[Restarter]) -> None:
    """Pause the members."""
    for restarter in restarters:
        restarter.pause()


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
