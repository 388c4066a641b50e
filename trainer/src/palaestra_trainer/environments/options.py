"""The options of the task, which vary it without changes to its code."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from palaestra_trainer.environments.observation import PARTS
from palaestra_trainer.environments.rewards import WEIGHTS
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import Movement

ACTIONS = ("discrete", "continuous")
TIME_UP = ("terminated", "truncated")
# `Sparse` has a reward for time-up, so its episode ends there. `Dense` does not: see docs/environments.md.
TIME_UP_OF = {"Dense": "truncated", "Sparse": "terminated"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """The options of `MoveToTargetEnv`, checked.

    Args:
        reward: `Dense` gives a reward at each step, `Sparse` only at the end of an episode.
        observe: the parts of the observation, in this order.
        movements: the choices of a discrete action, in this order.
        actions: `discrete` (one of `movements`) or `continuous` (a twist).
        max_steps: steps until time is up.
        time_up: how an episode then ends, `terminated` or `truncated`; None: `TIME_UP_OF` the reward.

    Raises:
        ConfigurationError: one line for every mistake.
    """

    reward: str = "Dense"
    observe: Sequence[str] = ("sensors", "velocity", "target", "time_left")
    movements: Sequence[Movement] = tuple(Movement)
    actions: str = "discrete"
    max_steps: int = 100
    time_up: str | None = None

    def __post_init__(self) -> None:
        if mistakes := list(_mistakes(self)):
            raise ConfigurationError("\n".join(mistakes))

    @property
    def time_up_terminates(self) -> bool:
        """Whether time-up ends the episode as terminated, so that a learner estimates no value beyond it."""
        return (self.time_up or TIME_UP_OF[self.reward]) == "terminated"


def parse(given: Mapping[str, Any]) -> Options:
    """Return options from the values in a job file, which has movements and parts by name.

    Raises:
        ConfigurationError: one line for every mistake.
    """
    known = [field.name for field in fields(Options)]
    if unknown := [name for name in given if name not in known]:
        raise ConfigurationError(
            "\n".join(f"{name}: is not an option; use {', '.join(known)}" for name in unknown)
        )
    return Options(**{**given, "movements": _movements(given.get("movements", tuple(Movement)))})


def _movements(given: Sequence[Movement | str]) -> tuple[Movement, ...]:
    known = Movement.__members__
    if unknown := [str(it) for it in given if it not in known and it not in known.values()]:
        raise ConfigurationError(f"movements: {', '.join(unknown)} not known; use {', '.join(known)}")
    return tuple(known[it] if isinstance(it, str) else Movement(it) for it in given)


def _mistakes(options: Options) -> Iterator[str]:
    if options.reward not in WEIGHTS:
        yield f"reward: {options.reward!r} is not a reward; use {' or '.join(WEIGHTS)}"
    yield from _mistakes_of_parts(options.observe)
    if options.actions not in ACTIONS:
        yield f"actions: {options.actions!r} is not known; use {' or '.join(ACTIONS)}"
    if not options.movements:
        yield f"movements: is empty; choose from {', '.join(Movement.__members__)}"
    if len(set(options.movements)) < len(options.movements):
        yield "movements: contains a movement twice; name each once"
    if options.max_steps < 1:
        yield f"max_steps: {options.max_steps} leaves no time; use at least 1"
    if options.time_up not in (None, *TIME_UP):
        yield f"time_up: {options.time_up!r} is not known; use {' or '.join(TIME_UP)}"


def _mistakes_of_parts(names: Sequence[str]) -> Iterator[str]:
    for name in names:
        if name not in PARTS:
            yield f"observe: {name!r} is not a part; use {', '.join(PARTS)}"
    if not names:
        yield f"observe: is empty; choose from {', '.join(PARTS)}"
    if len(set(names)) < len(names):
        yield "observe: contains a part twice; name each once"
