"""Players that begin and step together, and the simulators that they have until they are closed."""

from __future__ import annotations

import atexit
import os
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from palaestra_trainer.errors import SimulatorHung
from palaestra_trainer.fault_tolerant.episode_runner import EpisodeRunner, StepResult
from palaestra_trainer.simulators.restarter import Restarter, await_one
from palaestra_trainer.waiting.greenlets import take_turns

Options = dict[str, Any] | None


def _nothing(rows: Sequence[StepResult]) -> None:
    del rows


class EnvGroup:
    """One player for each member.

    They release their simulators by `close`, or at the end of the process.

    Args:
        keepers: one for each member, which is up or is being started.
        release: stops the simulators and gives them back.
        deadline_s: the longest wait for a simulator that is being mended.
        mend_at_once: whether a step waits for the mending itself, and not only the next reset.
        played: called with the rows of each step.

    Attributes:
        all: in the order of `keepers`.
    """

    def __init__(
        self,
        keepers: Sequence[Restarter],
        release: Callable[[], None],
        deadline_s: float = 600.0,
        *,
        mend_at_once: bool = False,
        played: Callable[[Sequence[StepResult]], None] = _nothing,
    ) -> None:
        self.all = [EpisodeRunner(keeper) for keeper in keepers]
        self._release = release
        self._deadline_s = deadline_s
        self._mend_at_once = mend_at_once
        self._played = played
        self._process: int | None = os.getpid()
        atexit.register(self.close)

    def begin(self, seeds: Sequence[int | None], options: Sequence[Options]) -> None:
        """Begin an episode in each member at once; wait until all are up.

        Raises:
            FaultBudgetSpent: the restart budget of a member is used up.
            SimulatorHung: a member was not mended within the deadline.
            ConfigurationError: a world lacks what the environment needs, or an option is wrong.
            MasterLost: no ROS master answers.
        """
        for player, seed, own in zip(self.all, seeds, options, strict=True):
            player.prepare(seed, own)
        self._begin_prepared()

    def step(self, action: Any) -> StepResult:
        """Return the row of a step of the only player; where its episode ended, none is under way.

        Raises:
            ResetNeeded: no episode is under way.
            Diverged: observation or reward is not finite.
            FaultBudgetSpent: as `begin`, if it mends at once.
        """
        [player] = self.all
        row = player.step(action)
        self._played([row])
        if self._mend_at_once:
            self._await_up()
        return row

    def step_all(self, actions: Sequence[Any]) -> list[StepResult]:
        """Return the rows of a step of all players at once; where an episode ended, the next one has begun.

        Raises:
            ResetNeeded: an episode is not under way.
            Diverged: observation or reward is not finite.
            As `begin`.
        """
        rows: list[StepResult] = take_turns(
            partial(_step, player, action) for player, action in zip(self.all, actions, strict=True)
        )
        self._played(rows)
        self._begin_prepared()
        return rows

    def close(self) -> None:
        """Release the simulators; safe to repeat, without effect in a forked process."""
        if self._process == os.getpid():
            self._process = None
            atexit.unregister(self.close)
            self._release()

    def _begin_prepared(self) -> None:
        give_up = time.monotonic() + self._deadline_s
        while waiting := [player for player in self.all if not player.playing]:
            take_turns(player.begin for player in waiting)
            self._await_one([player.keeper for player in waiting if not player.playing], give_up)

    def _await_up(self) -> None:
        give_up = time.monotonic() + self._deadline_s
        while waiting := [player.keeper for player in self.all if not player.keeper.up()]:
            self._await_one(waiting, give_up)

    def _await_one(self, keepers: Sequence[Restarter], give_up: float) -> None:
        await_one(keepers, partial(self._check, keepers, give_up))

    def _check(self, keepers: Sequence[Restarter], give_up: float) -> None:
        if time.monotonic() > give_up:
            fact = f"not mended within {self._deadline_s:g} s; read the simulator's log"
            raise SimulatorHung(", ".join(keeper.name for keeper in keepers), fact)


def _step(player: EpisodeRunner, action: Any) -> StepResult:
    row = player.step(action)
    if row.ended:
        player.prepare()
        player.begin()
    return row
