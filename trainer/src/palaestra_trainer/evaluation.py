"""Measuring a policy: whole episodes with given seeds, and what came of them.

A faulted episode is played again with its seed, so an evaluation always has
all of its episodes and two policies are compared on the same ones.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import FIRST_EXCEPTION, CancelledError, ThreadPoolExecutor, wait
from dataclasses import dataclass
from statistics import fmean
from typing import Any, Protocol

import numpy as np

from palaestra_trainer.errors import SimulatorFault
from palaestra_trainer.interruption import Check, go_on
from palaestra_trainer.simulators.member import Keeper, Member


class Policy(Protocol):
    """Whatever chooses an action for an observation; every Stable-Baselines3 model does."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,  # noqa: FBT001, FBT002 - as in Stable-Baselines3
    ) -> tuple[Any, Any]:
        """Return an action for one observation, and the policy's next state."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """How one episode went.

    Attributes:
        seed: the seed it was reset with.
        total_reward: undiscounted sum of its rewards.
        length: its environment steps.
        success: whether the environment said so at its end (`info["is_success"]`).
    """

    seed: int
    total_reward: float
    length: int
    success: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """The episodes of one evaluation, never none, and what it took to play them.

    Attributes:
        episodes: in the order of their seeds.
        faults: episodes that a fault cut and that were played again.
        seconds: wall time of all of them together.
    """

    episodes: tuple[Episode, ...]
    faults: int
    seconds: float

    @property
    def success_rate(self) -> float:
        """Share of episodes that succeeded, 0 to 1."""
        return fmean(episode.success for episode in self.episodes)

    @property
    def mean_return(self) -> float:
        """Mean undiscounted reward of an episode."""
        return fmean(episode.total_reward for episode in self.episodes)

    @property
    def mean_length(self) -> float:
        """Mean number of steps of an episode."""
        return fmean(episode.length for episode in self.episodes)

    @property
    def score(self) -> tuple[float, float]:
        """What the best evaluation has most of: success, then return."""
        return (self.success_rate, self.mean_return)

    def summary(self) -> dict[str, float | int]:
        """Return the means, as a line of evaluations.jsonl has them."""
        return {
            "episodes": len(self.episodes),
            "success_rate": round(self.success_rate, 4),
            "mean_return": round(self.mean_return, 4),
            "mean_length": round(self.mean_length, 2),
            "faults": self.faults,
        }


def evaluate(
    policy: Policy, member: Member | Keeper, seeds: Iterable[int], check: Check = go_on
) -> Evaluation:
    """Return how `policy` does in one episode for each of `seeds`, choosing greedily.

    Args:
        policy: what chooses the actions.
        member: the simulator it is played in, or the keeper of one.
        seeds: at least one; a faulted episode is played again with its own.
        check: called before each episode; raises to give the evaluation up.

    Raises:
        FaultBudgetSpent: the simulator broke more often than its budget allows.
    """
    keeper = member if isinstance(member, Keeper) else Keeper(member)
    started = time.monotonic()
    episodes: list[Episode] = []
    faults = 0
    for seed in seeds:
        check()
        while True:
            try:
                episodes.append(_play(policy, keeper, seed))
                break
            except SimulatorFault as fault:
                faults += 1
                keeper.mend(fault)
    return Evaluation(episodes=tuple(episodes), faults=faults, seconds=time.monotonic() - started)


def evaluate_on_all(
    policy: Policy, keepers: Sequence[Keeper], seeds: Iterable[int], check: Check = go_on
) -> Evaluation:
    """Return the same as `evaluate`, with the episodes shared out to several simulators at once."""
    wanted = list(seeds)
    shares = [wanted[first :: len(keepers)] for first in range(len(keepers))]
    busy = [(keeper, share) for keeper, share in zip(keepers, shares, strict=True) if share]
    if len(busy) == 1:
        return evaluate(policy, busy[0][0], wanted, check)
    started = time.monotonic()
    over = threading.Event()

    def check_all() -> None:
        check()
        if over.is_set():
            raise CancelledError

    with ThreadPoolExecutor(len(busy), "evaluate") as pool:
        futures = [pool.submit(evaluate, policy, keeper, share, check_all) for keeper, share in busy]
        try:
            done, _ = wait(futures, return_when=FIRST_EXCEPTION)
            for future in done:
                future.result()
        finally:
            over.set()
    parts = [future.result() for future in futures]
    dealt = itertools.zip_longest(*(part.episodes for part in parts))
    return Evaluation(
        episodes=tuple(episode for deal in dealt for episode in deal if episode is not None),
        faults=sum(part.faults for part in parts),
        seconds=time.monotonic() - started,
    )


def _play(policy: Policy, keeper: Keeper, seed: int) -> Episode:
    env = keeper.member.env
    observation, _ = keeper.reset(itertools.repeat(seed))
    total_reward, length, over = 0.0, 0, False
    info: dict[str, Any] = {}
    while not over:
        action, _ = policy.predict(observation, deterministic=True)
        observation, reward, terminated, truncated, info = env.step(np.asarray(action)[()])
        keeper.watcher.stepped(1)
        total_reward += float(reward)
        length += 1
        over = terminated or truncated
    return Episode(
        seed=seed,
        total_reward=total_reward,
        length=length,
        success=bool(info.get("is_success", False)),
    )
