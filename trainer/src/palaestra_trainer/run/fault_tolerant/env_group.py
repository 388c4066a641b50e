"""A group of environments that reset and step at the same time, each in its own simulator."""

from __future__ import annotations

import atexit
import os
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from palaestra_trainer.errors import SimulatorHung
from palaestra_trainer.run.fault_tolerant.episode_runner import EpisodeRunner, StepResult
from palaestra_trainer.simulators.restarter import Restarter, await_one
from palaestra_trainer.waiting.greenlets import take_turns

Options = dict[str, Any] | None


def _nothing(rows: Sequence[StepResult]) -> None:
    del rows


class EnvGroup:
    """A group that has an `EpisodeRunner` for each member.

    `close` releases the simulators. Without a call of `close`, they are released at the end of the process.

    Args:
        restarters: the restarter of each member; the members have started or are starting.
        release: a function that stops and releases the simulators.
        deadline_s: the longest time to wait for a simulator that restarts.
        wait_for_restart: whether the step with the fault waits until the restart is complete; if not, the
            next reset waits.
        played: a function that gets the rows of each step.

    Attributes:
        all: the runners, in the order of `restarters`.
    """

    def __init__(
        self,
        restarters: Sequence[Restarter],
        release: Callable[[], None],
        deadline_s: float = 600.0,
        *,
        wait_for_restart: bool = False,
        played: Callable[[Sequence[StepResult]], None] = _nothing,
    ) -> None:
        self.all = [EpisodeRunner(restarter) for restarter in restarters]
        self._release = release
        self._deadline_s = deadline_s
        self._wait_for_restart = wait_for_restart
        self._played = played
        self._process: int | None = os.getpid()
        atexit.register(self.close)

    def begin(self, seeds: Sequence[int | None], options: Sequence[Options]) -> None:
        """Begin an episode in every member at the same time; first wait until all members are up.

        Raises:
            FaultBudgetSpent: the restart budget of a member is spent.
            SimulatorHung: a member was not restarted within the deadline.
            ConfigurationError: a world lacks a device or node that the environment needs, or an option is
                wrong.
            MasterLost: no ROS master responds.
        """
        for player, seed, own in zip(self.all, seeds, options, strict=True):
            player.prepare(seed, own)
        self._begin_prepared()

    def step(self, action: Any) -> StepResult:
        """Step the only member and return its row; do not begin a new episode.

        Raises:
            ResetNeeded: no episode is running.
            Diverged: observation or reward is not finite.
            FaultBudgetSpent: as `begin`, if `wait_for_restart`.
        """
        [player] = self.all
        row = player.step(action)
        self._played([row])
        if self._wait_for_restart:
            self._await_up()
        return row

    def step_all(self, actions: Sequence[Any]) -> list[StepResult]:
        """Step all members at the same time and return their rows; replace each ended episode by a new one.

        Raises:
            ResetNeeded: a member has no running episode.
            Diverged: observation or reward is not finite.
            The same errors as `begin`.
        """
        rows: list[StepResult] = take_turns(
            partial(_step, player, action) for player, action in zip(self.all, actions, strict=True)
        )
        self._played(rows)
        self._begin_prepared()
        return rows

    def close(self) -> None:
        """Release the simulators; further calls, and calls in a forked process, have no effect."""
        if self._process == os.getpid():
            self._process = None
            atexit.unregister(self.close)
            self._release()

    def _begin_prepared(self) -> None:
        give_up = time.monotonic() + self._deadline_s
        while waiting := [player for player in self.all if not player.playing]:
            take_turns(player.begin for player in waiting)
            self._await_one([player.restarter for player in waiting if not player.playing], give_up)

    def _await_up(self) -> None:
        give_up = time.monotonic() + self._deadline_s
        while waiting := [player.restarter for player in self.all if not player.restarter.up()]:
            self._await_one(waiting, give_up)

    def _await_one(self, restarters: Sequence[Restarter], give_up: float) -> None:
        await_one(restarters, partial(self._check, restarters, give_up))

    def _check(self, restarters: Sequence[Restarter], give_up: float) -> None:
        if time.monotonic() > give_up:
            fact = f"not restarted within {self._deadline_s:g} s; read the simulator's log"
            raise SimulatorHung(", ".join(restarter.name for restarter in restarters), fact)


def _step(player: EpisodeRunner, action: Any) -> StepResult:
    row = player.step(action)
    if row.ended:
        player.prepare()
        player.begin()
    return row
