"""The options of the tasks; a job sets them to vary a task without changes to its code."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol, TypeVar

from palaestra_trainer.environments.observation import PARTS
from palaestra_trainer.environments.rewards import WEIGHTS
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.geometry import Movement

ACTIONS = ("discrete", "continuous")
TIME_UP = ("terminated", "truncated")
# `Sparse` has a reward term for the time limit, so the time limit terminates its episodes. `Dense` has no
# such term, so the time limit truncates its episodes. docs/explain/tasks.md gives the reasons.
TIME_UP_OF = {"Dense": "truncated", "Sparse": "terminated"}


FRAMES = (1, 3)


class Episodes(Protocol):
    """The options that all tasks with a target share; `MoveToTargetOptions` explains them."""

    @property
    def reward(self) -> str:
        """`Dense` or `Sparse`."""
        ...

    @property
    def actions(self) -> str:
        """`discrete` or `continuous`."""
        ...

    @property
    def max_steps(self) -> int:
        """Steps until time is up."""
        ...

    @property
    def time_up(self) -> str | None:
        """How an episode ends when time is up, one of `TIME_UP`; None: the reward's value in `TIME_UP_OF`."""
        ...


class Driving(Episodes, Protocol):
    """The options that all tasks of a robot share if it drives in all directions."""

    @property
    def movements(self) -> Sequence[Movement]:
        """The choices of a discrete action, in this order."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveToTargetOptions:
    """The options of `MoveToTargetEnv`, checked.

    Args:
        reward: `Dense` gives a reward at each step, `Sparse` only at the end of an episode.
        observe: the parts of the observation, in this order.
        movements: the choices of a discrete action, in this order.
        actions: with `discrete` an action is one of `movements`, with `continuous` it is a twist.
        max_steps: steps until time is up.
        time_up: how an episode ends when time is up, `terminated` or `truncated`; None: the reward's value in
            `TIME_UP_OF`.

    Raises:
        ConfigurationError: an option is wrong; the message has one line for every mistake.
    """

    reward: str = "Dense"
    observe: Sequence[str] = ("sensors", "velocity", "target", "time_left")
    movements: Sequence[Movement] = tuple(Movement)
    actions: str = "discrete"
    max_steps: int = 100
    time_up: str | None = None

    def __post_init__(self) -> None:
        _refuse((*_mistakes(self), *_mistakes_of_parts(self.observe)))


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalOptions(MoveToTargetOptions):
    """The checked options of `MoveToTargetGoalEnv`, which are `MoveToTargetOptions` with other defaults.

    Args:
        observe: the parts of `observation`; `target` is refused, because the goal has its own keys.
        time_up: see `MoveToTargetOptions`; by default `truncated`, because no reward depends on the time
            limit.

    Raises:
        ConfigurationError: an option is wrong; the message has one line for every mistake.
    """

    observe: Sequence[str] = ("sensors", "velocity", "position", "time_left")
    time_up: str | None = TIME_UP[1]

    def __post_init__(self) -> None:
        parts = (*_mistakes_of_parts(self.observe), *_mistakes_of_goals(self.observe))
        _refuse((*_mistakes(self), *parts))


@dataclass(frozen=True, slots=True, kw_only=True)
class DeliverOptions(MoveToTargetOptions):
    """The checked options of `DeliverEnv`: `MoveToTargetOptions` with defaults for several targets.

    Args:
        targets: number of targets in an episode.

    Raises:
        ConfigurationError: an option is wrong; the message has one line for every mistake.
    """

    observe: Sequence[str] = ("sensors", "velocity", "target", "time_left", "to_reach")
    max_steps: int = 300
    targets: int = 3

    def __post_init__(self) -> None:
        too_few = () if self.targets >= 1 else (f"targets: {self.targets} are too few; use at least 1",)
        _refuse((*_mistakes(self), *_mistakes_of_parts(self.observe), *too_few))


@dataclass(frozen=True, slots=True, kw_only=True)
class SeeOptions:
    """The options of `SeeTargetEnv`, checked.

    Args:
        reward: see `MoveToTargetOptions`.
        movements: see `MoveToTargetOptions`.
        actions: see `MoveToTargetOptions`.
        max_steps: see `MoveToTargetOptions`.
        time_up: see `MoveToTargetOptions`.
        frames: number of newest images in an observation, 1 or 3.
        cylinders: whether the arena's four cylinders stand on the floor.

    Raises:
        ConfigurationError: an option is wrong; the message has one line for every mistake.
    """

    reward: str = "Dense"
    movements: Sequence[Movement] = tuple(Movement)
    actions: str = "discrete"
    max_steps: int = 100
    time_up: str | None = None
    frames: int = 1
    cylinders: bool = False

    def __post_init__(self) -> None:
        _refuse((*_mistakes(self), *_mistakes_of_images(self)))


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigateOptions:
    """The options of `NavigateEnv`, checked.

    Args:
        reward: see `MoveToTargetOptions`.
        actions: see `MoveToTargetOptions`.
        max_steps: see `MoveToTargetOptions`.
        time_up: see `MoveToTargetOptions`.

    Raises:
        ConfigurationError: an option is wrong; the message has one line for every mistake.
    """

    reward: str = "Dense"
    actions: str = "discrete"
    max_steps: int = 150
    time_up: str | None = None

    def __post_init__(self) -> None:
        _refuse(tuple(_mistakes_of_episodes(self)))


def time_up_terminates(options: Episodes) -> bool:
    """Return whether the time limit terminates an episode; then a learner counts later steps as worth 0."""
    return (options.time_up or TIME_UP_OF[options.reward]) == "terminated"


def parse(given: Mapping[str, Any]) -> MoveToTargetOptions:
    """Return the options of `MoveToTargetEnv` from the values in a job file.

    Raises:
        ConfigurationError: an option is wrong; the message has one line for every mistake.
    """
    return parse_as(MoveToTargetOptions, given)


_Chosen = TypeVar("_Chosen", bound=MoveToTargetOptions | SeeOptions | NavigateOptions)


def parse_as(kind: type[_Chosen], given: Mapping[str, Any]) -> _Chosen:
    """Return options from the values in a job file, in which movements and parts are written as names.

    Raises:
        ConfigurationError: an option is wrong; the message has one line for every mistake.
    """
    known = [field.name for field in fields(kind)]
    if unknown := [name for name in given if name not in known]:
        raise ConfigurationError(
            "\n".join(f"{name}: is not an option; use {', '.join(known)}" for name in unknown)
        )
    if "movements" in given:
        given = {**given, "movements": _movements(given["movements"])}
    return kind(**given)


def _movements(given: Sequence[Movement | str]) -> tuple[Movement, ...]:
    known = Movement.__members__
    if unknown := [str(it) for it in given if it not in known and it not in known.values()]:
        raise ConfigurationError(
            f"movements: contains unknown movements ({', '.join(unknown)}); use {', '.join(known)}"
        )
    return tuple(known[it] if isinstance(it, str) else Movement(it) for it in given)


def _refuse(mistakes: Sequence[str]) -> None:
    if mistakes:
        raise ConfigurationError("\n".join(mistakes))


def _mistakes(options: Driving) -> Iterator[str]:
    yield from _mistakes_of_episodes(options)
    if not options.movements:
        yield f"movements: is empty; choose from {', '.join(Movement.__members__)}"
    if len(set(options.movements)) < len(options.movements):
        yield "movements: contains a movement twice; name each once"


def _mistakes_of_episodes(options: Episodes) -> Iterator[str]:
    if options.reward not in WEIGHTS:
        yield f"reward: {options.reward!r} is not a reward; use {' or '.join(WEIGHTS)}"
    if options.actions not in ACTIONS:
        yield f"actions: {options.actions!r} is not known; use {' or '.join(ACTIONS)}"
    if options.max_steps < 1:
        yield f"max_steps: {options.max_steps} leaves no time; use at least 1"
    if options.time_up not in (None, *TIME_UP):
        yield f"time_up: {options.time_up!r} is not known; use {' or '.join(TIME_UP)}"


def _mistakes_of_parts(names: Sequence[str]) -> Iterator[str]:
    for name in names:
        if name not in PARTS:
            yield f"observe: {name!r} is not a part of the observation; use {', '.join(PARTS)}"
    if not names:
        yield f"observe: is empty; choose from {', '.join(PARTS)}"
    if len(set(names)) < len(names):
        yield "observe: contains a part twice; name each once"


def _mistakes_of_goals(names: Sequence[str]) -> Iterator[str]:
    if "target" in names:
        yield "observe: the policy must see the target only as its desired goal; remove target"


def _mistakes_of_images(options: SeeOptions) -> Iterator[str]:
    if options.frames not in FRAMES:
        yield f"frames: {options.frames!r} is not a number of frames; use {' or '.join(map(str, FRAMES))}"
    given: object = options.cylinders
    if not isinstance(given, bool):
        yield f"cylinders: {given!r} is neither true nor false; use one of them"
