"""All simulators of a run, by role: started and stopped together, resting in turns."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, wait
from contextlib import contextmanager

from palaestra_trainer.configuration import Configuration, SimulatorConfiguration
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.interruption import Check, go_on
from palaestra_trainer.simulators.member import Care, Keeper, Member, Watcher

LOOK_EVERY_S = 0.1


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
        keepers = {
            wanted.name: Keeper(by_name[wanted.name], care_of(wanted), watcher)
            for wanted in configuration.simulators
        }
        self.collecting = [keepers[wanted.name] for wanted in configuration.with_role("Collect")]
        self.evaluating = [keepers[wanted.name] for wanted in configuration.with_role("Evaluate")]
        self._all = [*self.collecting, *self.evaluating]

    def start(self, check: Check = go_on) -> None:
        """Start all members at once.

        Args:
            check: called every tenth of a second; what it raises, such as `Interrupted`, waits for
                no member: a try that is under way may go on in its thread, and no other is begun.

        Raises:
            FaultBudgetSpent: one of them does not come up, however often it is tried.
        """
        check()
        starts = [in_background(Keeper.start, keeper) for keeper in self._all]
        try:
            while wait(starts, LOOK_EVERY_S).not_done:
                check()
            for start in starts:
                start.result()
        except BaseException:
            for keeper in self._all:
                keeper.give_up()
            raise

    def stop(self) -> None:
        """Stop all members at once, however they are."""
        stops = [in_background(Keeper.stop, keeper) for keeper in self._all]
        wait(stops)
        for stop in stops:
            stop.result()


def in_background(work: Callable[[Keeper], None], keeper: Keeper) -> Future[None]:
    """Begin to work on one keeper in a thread that does not keep the process from ending."""
    future: Future[None] = Future()

    def run() -> None:
        try:
            work(keeper)
        except BaseException as error:  # noqa: BLE001 - whoever asks for the result gets it
            future.set_exception(error)
        else:
            future.set_result(None)

    threading.Thread(target=run, name=f"fleet-{keeper.name}", daemon=True).start()
    return future


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


def care_of(simulator: SimulatorConfiguration) -> Care:
    """Return how the configuration wants one member to be looked after."""
    return Care(
        recycle_after_resets=simulator.recycle.after_resets if simulator.recycle else None,
        restart_limit=simulator.restart.limit,
        restart_within_s=simulator.restart.within_seconds,
    )
