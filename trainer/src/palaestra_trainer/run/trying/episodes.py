"""Play the episodes of `palaestra-try`, and collect their results and problems."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import wait
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from palaestra_trainer.environments.episode_end import REMEDY
from palaestra_trainer.environments.masks import gives_masks
from palaestra_trainer.episodes.evaluation import Episode
from palaestra_trainer.episodes.reset_options import reset_options
from palaestra_trainer.episodes.seeds import episode_seeds
from palaestra_trainer.errors import Diverged, FaultBudgetSpent, SimulatorFault, TrainerError, fact_of
from palaestra_trainer.run.signals import Interrupted
from palaestra_trainer.run.trying.agents import Agent, EndEpisode, EndTry
from palaestra_trainer.run.trying.problems import Problems, beyond, check_by_libraries
from palaestra_trainer.run.trying.step_times import StepTimes
from palaestra_trainer.simulators.restarter import LOOK_EVERY_S, Restarter
from palaestra_trainer.waiting.check import Check

SEEDS = "try"  # the stream of the episodes' seeds
MOST_STEPS = 10_000  # limit of one episode; a person does not wait as long as a trainer


@dataclass(slots=True, kw_only=True)
class Tried:
    """The results of `palaestra-try`.

    Attributes:
        episodes: the episodes that the environment ended.
        problems: the problems of the environment and its simulator.
        times: number of steps, and their total seconds in the simulator, in transport and in the environment.
        reset_s: duration of each reset, in seconds.
        rewards: number of rewards that were not 0.
        moved: whether any observation differed from the first observation of its episode.
    """

    episodes: list[Episode] = field(default_factory=list)
    problems: Problems = field(default_factory=Problems)
    times: StepTimes = field(default_factory=StepTimes)
    reset_s: list[float] = field(default_factory=list)
    rewards: int = 0
    moved: bool = False


class _Stop(Exception):
    """The environment has a problem after which it cannot continue."""


def seeds(seed: int, episodes: int) -> Iterator[int]:
    """Yield seeds for episodes of `palaestra-try`, which has a stream of its own."""
    return episode_seeds(seed, SEEDS, episodes)


def play(
    restarter: Restarter,
    agent: Agent,
    seeds: Iterable[int],
    check: Check,
    report: Callable[[int, Episode], object],
) -> Tried:
    """Run the checkers and play an episode for each seed; return the results and problems.

    Args:
        restarter: the restarter of a simulator that is up.
        agent: chooses the actions.
        seeds: the seeds of the episodes, at least one.
        check: called before each step and during waits; it raises to cancel the remaining episodes.
        report: called after each complete episode, with its number from 1 and its result.

    Raises:
        FaultBudgetSpent: the simulator failed more often than its restart budget allows.
    """
    tried = Tried()
    try:
        _attempt(restarter, tried, partial(check_by_libraries, restarter.member.env, tried.problems))
        for number, seed in enumerate(seeds, 1):
            _await_simulator(restarter, check)
            before = len(tried.episodes)
            _attempt(restarter, tried, partial(_episode, restarter, agent, (number, seed), tried, check))
            if len(tried.episodes) > before:
                report(number, tried.episodes[-1])
    except (_Stop, EndTry):
        pass
    for line in _of_all(tried):
        tried.problems.add(line)
    return tried


def _attempt(restarter: Restarter, tried: Tried, work: Callable[[], None]) -> None:
    """Call `work`; record an error of the environment as a problem."""
    try:
        work()
    except EndEpisode:
        return
    except (EndTry, FaultBudgetSpent, Interrupted, _Stop):
        raise
    except SimulatorFault as fault:
        tried.problems.add(
            f"a fault of the simulator ended an episode ({fault}); `palaestra run -v` shows its output"
        )
        restarter.begin_restart(fault)
    except Diverged as error:
        tried.problems.add(str(error))
    except TrainerError as error:
        tried.problems.add(str(error))
        raise _Stop from error
    except Exception as error:  # the environment is code of the user, which may raise anything
        tried.problems.add(f"the environment raised {fact_of(error)}; fix the environment")
        raise _Stop from error


def _await_simulator(restarter: Restarter, check: Check) -> None:
    while not restarter.up():
        check()
        if work := restarter.under_way:
            wait([work], LOOK_EVERY_S)


def _episode(restarter: Restarter, agent: Agent, game: tuple[int, int], tried: Tried, check: Check) -> None:
    number, seed = game
    env, times = restarter.member.env, tried.times
    began = time.perf_counter()
    first, _ = restarter.reset(seed, reset_options(0.0, number - 1), check)
    tried.reset_s.append(time.perf_counter() - began)
    rewards: list[float] = []
    info: dict[str, Any] = {}
    over = False
    _see(tried, env, first, first)
    while not over:
        check()
        if len(rewards) == MOST_STEPS:
            tried.problems.add(f"an episode has not ended after {MOST_STEPS:,} steps; {REMEDY}")
            raise _Stop
        action = agent.act(restarter.action_mask() if gives_masks(env) else None)
        with times.step(lambda: _transport_s(restarter)):
            observation, reward, terminated, truncated, info = restarter.step(action)
        _see(tried, env, first, observation)
        rewards.append(float(reward))
        tried.rewards += reward != 0
        agent.got(len(rewards), float(reward))
        over = terminated or truncated
    outcome = info.get("outcome")
    tried.episodes.append(
        Episode(
            seed=seed,
            total_reward=math.fsum(rewards),
            length=len(rewards),
            success=bool(info["is_success"]) if "is_success" in info else None,
            outcome=outcome if isinstance(outcome, str) else None,
        )
    )


def _see(tried: Tried, env: Any, first: Any, observation: Any) -> None:
    if sentence := beyond(env.observation_space, observation):
        tried.problems.add(sentence)
    tried.moved = tried.moved or not _equal(first, observation)


def _equal(one: Any, other: Any) -> bool:
    if isinstance(one, dict):
        return all(_equal(part, other[name]) for name, part in one.items())
    if isinstance(one, tuple):
        return all(map(_equal, one, other))
    return np.array_equal(one, other)


def _transport_s(restarter: Restarter) -> float:
    """Return the seconds that the member has spent on transport so far; 0 if it has no simulation."""
    robot = getattr(restarter.member, "robot", None)
    return float(robot.simulation.transport_s) if robot is not None else 0.0


def _of_all(tried: Tried) -> Iterable[str]:
    """Yield the problems that can be found only after all episodes."""
    if not tried.times.count:
        return
    steps = f"{tried.times.count:,} steps"
    if not tried.moved:
        yield (
            f"no observation changed in {steps}; return a new array from each step, "
            "and do not change the old one in place"
        )
    if not tried.rewards:
        yield f"every reward of {steps} was 0; check the reward, unless it is for rare successes only"
    if tried.episodes and all(episode.success is None for episode in tried.episodes):
        yield 'no episode reported its success; set info["is_success"] in its last step for a success rate'
