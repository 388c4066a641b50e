"""One row of a vector step: a member that plays episode after episode.

Translates gymnasium's step into the row that Stable-Baselines3 expects (reset
in the same step, `terminal_observation`, `TimeLimit.truncated`, Monitor's
`episode`) and a fault into an invalid row: done, truncated, `info["valid"]`
False and `info["sim_fault"]`.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, NamedTuple

from palaestra_trainer.errors import SimulatorFault
from palaestra_trainer.seeds import COLLECT, episode_seed
from palaestra_trainer.simulators.member import Environment, Keeper


class Row(NamedTuple):
    """What one member contributes to a vector step.

    Attributes:
        observation: the next one; the first of the next episode where `done`.
        reward: of this step; 0 in an invalid row.
        done: the episode ended, by its own end, by a time limit, or by a fault.
        info: what the environment reported, and the keys named in this module's docstring.
    """

    observation: Any
    reward: float
    done: bool
    info: dict[str, Any]


class Collector:
    """Plays the episodes of one member, each with the seed that its number gives it.

    Attributes:
        keeper: looks after the member.
        run_seed: the replica's seed.
        index: the member's position among the collecting ones.
        episode: number of the next episode; continue a run by setting it.
        reset_info: what the environment reported at the last reset.
    """

    def __init__(self, keeper: Keeper, run_seed: int, index: int, episode: int = 0) -> None:
        self.keeper = keeper
        self.run_seed = run_seed
        self.index = index
        self.episode = episode
        self.reset_info: dict[str, Any] = {}
        self._seeds = self._following_seeds()
        self._started = time.monotonic()
        self._observation: Any = None
        self._return = 0.0
        self._length = 0

    @property
    def env(self) -> Environment:
        """The member's environment."""
        return self.keeper.member.env

    def next_seed(self) -> int:
        """Return the seed that the next episode will have."""
        return episode_seed(self.run_seed, COLLECT, self.index, self.episode)

    def begin(self, options: dict[str, Any] | None = None) -> Any:
        """Return the first observation of the next episode."""
        self._observation, self.reset_info = self.keeper.reset(self._seeds, options)
        self._started = time.monotonic()
        self._return = 0.0
        self._length = 0
        return self._observation

    def step(self, action: Any) -> Row:
        """Return the row of one step; a fault ends the episode and is mended here.

        Raises:
            FaultBudgetSpent: the member's budget of restarts is used up.
        """
        try:
            observation, reward, terminated, truncated, info = self.env.step(action)
        except SimulatorFault as fault:
            return self._broken(fault)
        self._observation = observation
        self._return += float(reward)
        self._length += 1
        info["valid"] = True
        info["TimeLimit.truncated"] = truncated and not terminated
        if terminated or truncated:
            info["terminal_observation"] = observation
            info["episode"] = self._episode()
            return Row(self.begin(), float(reward), True, info)
        return Row(observation, float(reward), False, info)

    def _broken(self, fault: SimulatorFault) -> Row:
        info = {
            "valid": False,
            "sim_fault": {
                "kind": fault.kind,
                "simulator": self.keeper.name,
                "fact": str(fault),
                "episode": self.episode - 1,
                "step": self._length,
            },
            "TimeLimit.truncated": True,
            "terminal_observation": self._observation,
        }
        self.keeper.mend(fault)
        return Row(self.begin(), 0.0, True, info)

    def _episode(self) -> dict[str, float]:
        seconds = time.monotonic() - self._started
        return {"r": round(self._return, 6), "l": self._length, "t": round(seconds, 6)}

    def _following_seeds(self) -> Iterator[int]:
        while True:
            seed = self.next_seed()
            self.episode += 1
            yield seed
