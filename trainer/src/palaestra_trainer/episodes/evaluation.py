"""Evaluate a policy in whole episodes with given seeds.

If a fault truncates an episode, a free simulator plays this episode again with the same seed. So an
evaluation always has all of its episodes, and two policies are compared on the same episodes.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import wait
from dataclasses import dataclass, field, replace
from functools import partial
from statistics import fmean
from typing import Any, Protocol

import numpy as np

from palaestra_protocol.pod.status import SuccessInterval
from palaestra_trainer.environments.episode_end import EpisodeEnd
from palaestra_trainer.environments.masks import ACTION_MASKS
from palaestra_trainer.episodes.film import MOST_FILMS, Film, Filming
from palaestra_trainer.episodes.reset_options import EVALUATING, reset_options
from palaestra_trainer.episodes.wilson import wilson
from palaestra_trainer.errors import FaultBudgetSpent, SimulatorFault
from palaestra_trainer.simulators.interface import Member
from palaestra_trainer.simulators.restarter import LOOK_EVERY_S, Restarter
from palaestra_trainer.waiting.at_once import at_once
from palaestra_trainer.waiting.check import Check, go_on


class ActingPolicy(Protocol):
    """An object that chooses an action for an observation, such as every Stable-Baselines3 model.

    A policy whose attribute `takes_masks` is true also gets the masks of allowed actions, as the argument
    `action_masks`.
    """

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
    """The result of one episode.

    Attributes:
        seed: seed of the episode's reset.
        total_reward: undiscounted sum of the episode's rewards.
        length: number of environment steps.
        success: the last step's `info["is_success"]`; None: the environment did not report success.
        outcome: the last step's `info["outcome"]` if it is a text, else None.
        film: a recording of the episode; None: the robot does not drive on a floor, or the episode is not one
            of the first `MOST_FILMS`.
    """

    seed: int
    total_reward: float
    length: int
    success: bool | None
    outcome: str | None = None
    film: Film | None = field(default=None, compare=False, repr=False)

    def record(self) -> dict[str, Any]:
        """Return the episode as in evaluations.jsonl, without values that the environment did not report."""
        known = {"success": self.success, "outcome": self.outcome}
        return {"seed": self.seed, "return": round(self.total_reward, 4), "length": self.length} | {
            name: value for name, value in known.items() if value is not None
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluationResult:
    """The result of one evaluation: at least one episode, the number of faults, and the time.

    Attributes:
        episodes: the episodes in the order of the given seeds.
        faults: how often a fault truncated an episode, which was then played again.
        seconds: wall time of the whole evaluation.
    """

    episodes: tuple[Episode, ...]
    faults: int
    seconds: float

    @property
    def success_rate(self) -> float | None:
        """Share of episodes that succeeded, 0 to 1; None: no episode reported its success."""
        return fmean(map(bool, successes)) if (successes := self._successes()) else None

    @property
    def success_interval(self) -> SuccessInterval | None:
        """The 95 % interval around `success_rate`; None if the rate is None."""
        successes = self._successes()
        return wilson(sum(map(bool, successes)), len(successes)) if successes else None

    def _successes(self) -> list[bool | None]:
        """Return the success of each episode; [] if no episode reported its success.

        An environment may report only successes, so None counts as failure if another episode reports a
        success.
        """
        successes = [episode.success for episode in self.episodes]
        return [] if all(success is None for success in successes) else successes

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
        """The rank of an evaluation: by success rate, then by mean return; the best has the highest rank."""
        return (self.success_rate or 0.0, self.mean_return)

    def summary(self) -> dict[str, float | int | None]:
        """Return the means over the episodes, and their number."""
        rate = self.success_rate
        return {
            "episodes": len(self.episodes),
            "success_rate": None if rate is None else round(rate, 4),
            "mean_return": round(self.mean_return, 4),
            "mean_length": round(self.mean_length, 2),
            "faults": self.faults,
        }

    def record(self) -> dict[str, Any]:
        """Return the content of a line of evaluations.jsonl: the means, the interval and each episode."""
        interval = self.success_interval
        return {
            **self.summary(),
            "success_interval": None if interval is None else interval.to_json(),
            "played": [episode.record() for episode in self.episodes],
        }


def evaluate(
    policy: ActingPolicy, member: Member | Restarter, seeds: Iterable[int], check: Check = go_on
) -> EvaluationResult:
    """Evaluate the deterministic actions of `policy` in one episode for each of `seeds`.

    Args:
        policy: the policy, which chooses the actions.
        member: the member that plays the episodes, or its restarter.
        seeds: the seeds of the episodes, at least one; an episode that a fault truncated is played again.
        check: called before each step and during waits for a simulator; it raises to cancel the evaluation.

    Raises:
        FaultBudgetSpent: the simulator failed more often than its restart budget allows.
    """
    restarter = member if isinstance(member, Restarter) else Restarter(member)
    return evaluate_on_all(policy, [restarter], seeds, check)


def evaluate_on_all(
    policy: ActingPolicy, restarters: Sequence[Restarter], seeds: Iterable[int], check: Check = go_on
) -> EvaluationResult:
    """Evaluate as `evaluate` does, but distribute the episodes over several simulators.

    If a simulator fails, another simulator plays its episode. Meanwhile the faulty simulator is restarted, or
    the evaluation continues without it.
    """
    started = time.monotonic()
    games = _Games(policy, seeds)
    while games.missing:
        left = sorted(
            (restarter for restarter in restarters if not restarter.lost),
            key=lambda restarter: restarter.busy,
        )
        if not left:
            raise FaultBudgetSpent("every evaluating simulator was given up; read the simulators' logs")
        if len(left) == 1:
            games.play_on(left[0], check)
        else:
            _play_at_once(games, left[: games.missing], check)
    return EvaluationResult(
        episodes=games.in_order(),
        faults=games.faults,
        seconds=time.monotonic() - started,
    )


class _Games:
    """The open and the complete episodes of one evaluation.

    Each thread plays one episode at a time. If a fault truncates the episode, the thread returns it to the
    open episodes. An idle thread waits until the last episode is complete, because it may have to play a
    truncated episode again.

    Attributes:
        faults: number of episodes that a fault truncated.
    """

    def __init__(self, policy: ActingPolicy, seeds: Iterable[int]) -> None:
        self.faults = 0
        self._policy = policy
        self._waiting = deque(enumerate(seeds))
        self._played: dict[int, Episode] = {}
        self._wanted = len(self._waiting)
        self._changed = threading.Condition()

    @property
    def missing(self) -> int:
        """Number of episodes that are not complete."""
        return self._wanted - len(self._played)

    def in_order(self) -> tuple[Episode, ...]:
        """Return the episodes in the order of their seeds."""
        return tuple(self._played[place] for place in sorted(self._played))

    def play_on(self, restarter: Restarter, check: Check) -> None:
        """Play until all episodes are complete, or until the run continues without this simulator."""
        while self.missing and not restarter.lost:
            check()
            if work := restarter.under_way:
                wait([work], LOOK_EVERY_S)
            elif restarter.up():
                self._play_next(restarter, check)

    def _play_next(self, restarter: Restarter, check: Check) -> None:
        with self._changed:
            if not self._waiting:
                self._changed.wait(LOOK_EVERY_S)
                return
            place, seed = self._waiting.popleft()
        rewards: list[float] = []
        filming = Filming(restarter.member if place < MOST_FILMS else None)
        try:
            episode = play(self._policy, restarter, (place, seed), check, rewards, filming.look)
        except SimulatorFault as fault:
            restarter.begin_restart(fault, len(rewards))
            with self._changed:
                self.faults += 1
                self._waiting.appendleft((place, seed))
                self._changed.notify_all()
        else:
            with self._changed:
                self._played[place] = replace(episode, film=filming.film())
                self._changed.notify_all()


def _play_at_once(games: _Games, restarters: Sequence[Restarter], check: Check) -> None:
    at_once([partial(games.play_on, restarter) for restarter in restarters], check, "evaluate")


def play(
    policy: ActingPolicy,
    restarter: Restarter,
    game: tuple[int, int],
    check: Check,
    rewards: list[float],
    look: Callable[[], None],
) -> Episode:
    """Play one episode to its end, and return its result without a film.

    Args:
        policy: the policy, which chooses the actions.
        restarter: the simulator.
        game: the number of the episode in its evaluation, and the seed of the episode.
        check: called before each step; it raises to cancel the episode.
        rewards: receives the reward of each step, also if an error ends the episode.
        look: called after the reset and after each step.

    Raises:
        SimulatorFault: the simulator failed; call `begin_restart`.
    """
    number, seed = game
    observation, _ = restarter.reset(seed, reset_options(EVALUATING, number), check)
    look()
    info: dict[str, Any] = {}
    memory: Any = None  # the state of a recurrent policy
    over, end, masked = False, EpisodeEnd("an evaluation"), getattr(policy, "takes_masks", False)
    while not over:
        check()
        end.not_after(len(rewards))
        masks: dict[str, Any] = {ACTION_MASKS: restarter.action_mask()} if masked else {}
        start = np.array([not rewards])
        action, memory = policy.predict(observation, memory, start, deterministic=True, **masks)
        observation, reward, terminated, truncated, info = restarter.step(np.asarray(action)[()])
        restarter.watcher.stepped(1)
        rewards.append(float(reward))
        look()
        over = terminated or truncated
    return Episode(
        seed=seed,
        total_reward=sum(rewards),
        length=len(rewards),
        success=bool(info["is_success"]) if "is_success" in info else None,
        outcome=outcome if isinstance(outcome := info.get("outcome"), str) else None,
    )
