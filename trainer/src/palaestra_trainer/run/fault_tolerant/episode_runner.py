"""Play the episodes of one member for a training loop that cannot handle faults.

Every row is valid. A fault truncates the episode: the row has the last observation before the fault, reward 0
and `sim_fault` (`palaestra_trainer.environments.infos`). The member is restarted in the background, and the
next episode begins when the member is up.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

from gymnasium.error import ResetNeeded
from gymnasium.utils.seeding import np_random

from palaestra_trainer.environments.copies import copied
from palaestra_trainer.environments.infos import OURS, of_environment
from palaestra_trainer.errors import SimulatorFault
from palaestra_trainer.simulators.interface import Environment, Step
from palaestra_trainer.simulators.restarter import Restarter


class StepResult(NamedTuple):
    """The result of one step.

    Attributes:
        step: the result of gymnasium's `step`.
        episode: return, length and seconds of the episode, under the names of Stable-Baselines3's Monitor.
            Only the last step of an episode without a fault has these values; for other steps, `episode` is
            None.
    """

    step: Step
    episode: dict[str, float] | None = None

    @property
    def info(self) -> dict[str, Any]:
        """The info of the step."""
        return self.step[4]

    @property
    def ended(self) -> bool:
        """Whether this step is the last step of its episode."""
        return self.step[2] or self.step[3]

    @property
    def marked(self) -> dict[str, Any]:
        """The info for Stable-Baselines3; in the row of a fault, the info has only Palaestra's keys."""
        cut = self.ended and self.episode is None
        return self.info if cut else of_environment(self.info)


class EpisodeRunner:
    """Plays the episodes of one member.

    Attributes:
        restarter: the restarter of the member.
        playing: whether an episode is running.
        observation: the last observation of the member.
        reset_info: the environment's info of the last reset.
    """

    def __init__(self, restarter: Restarter) -> None:
        self.restarter = restarter
        self.playing = False
        self.observation: Any = None
        self._last: Any = None  # a copy, because the training loop may write into `observation`
        self.reset_info: dict[str, Any] = {}
        self._return, self._length, self._began = 0.0, 0, 0.0
        self._random, _ = np_random()
        self._next: tuple[int, dict[str, Any] | None] = (0, None)

    @property
    def env(self) -> Environment:
        """The member's environment; after a takeover by a standby, it is another object."""
        return self.restarter.member.env

    def prepare(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        """Set seed and options of the next episode.

        If `seed` is None, the seed of the episode comes from the random generator of the last given seed. If
        a fault makes an episode begin twice, its seed stays the same.
        """
        if seed is not None:
            self._random, _ = np_random(seed)
        self._next = (int(self._random.integers(2**31)) if seed is None else seed, options)
        self.playing = False

    def begin(self) -> None:
        """Begin the prepared episode if the member is up; if that fails, begin to restart the member.

        Raises:
            FaultBudgetSpent: the member's restart budget is spent.
            ConfigurationError: the member's world lacks a device or node that the environment needs, or the
                member cannot be restarted.
            MasterLost: no ROS master responds.
            Diverged: the observation is not finite.
        """
        if not self.restarter.up():
            return
        seed, options = self._next
        try:
            self.observation, self.reset_info = self.restarter.reset(seed, options)
        except SimulatorFault as fault:
            self.restarter.begin_restart(fault)
            return
        self._last = copied(self.observation)
        self._return, self._length, self._began = 0.0, 0, time.monotonic()
        self.playing = True

    def step(self, action: Any) -> StepResult:
        """Return the row of one step.

        Raises:
            ResetNeeded: no episode is running.
            Diverged: observation or reward is not finite.
        """
        if not self.playing:
            raise ResetNeeded(f"{self.restarter.name}: no episode is under way; call reset() first")
        self.playing = False  # remains False if an interrupt ends the step
        try:
            step = self.restarter.step(action)
        except SimulatorFault as fault:
            return self._cut(fault)
        self.observation, reward, terminated, truncated, _ = step
        self._last = copied(self.observation)
        self._return += float(reward)
        self._length += 1
        self.playing = not (terminated or truncated)
        return StepResult(step, None if self.playing else self._summary())

    def _cut(self, fault: SimulatorFault) -> StepResult:
        self.restarter.begin_restart(fault, self._length)
        report = {
            "kind": fault.kind,
            "simulator": self.restarter.name,
            "fact": str(fault),
            "step": self._length,
        }
        return StepResult((self._last, 0.0, False, True, {OURS: {"sim_fault": report}}))

    def _summary(self) -> dict[str, float]:
        seconds = time.monotonic() - self._began
        return {"r": round(self._return, 6), "l": self._length, "t": round(seconds, 6)}
