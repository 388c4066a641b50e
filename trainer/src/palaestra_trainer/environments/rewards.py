"""The reward of a step: small named terms, and their weights in one place.

A term is a pure function of one transition, with its own range, and has a weight. An
environment reports every weighted term by name, so that a curve in TensorBoard shows
from which terms a policy gets its reward.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from palaestra_trainer.robots.base import SENSOR_RANGE_M

MARGIN_M = 0.18  # the space that should stay free around the robot, which drives half of it in a step


class EpisodeOutcome(Enum):
    """The way in which an episode ended, or that it continues, possibly with the next of several targets."""

    RUNNING = "running"
    DELIVERED = "delivered"
    REACHED = "reached"
    COLLIDED = "collided"
    TIME_UP = "time_up"

    @property
    def terminal(self) -> bool:
        """Whether the task itself is over, not only its time."""
        return self in (EpisodeOutcome.REACHED, EpisodeOutcome.COLLIDED)


@dataclass(frozen=True, slots=True, kw_only=True)
class Transition:
    """The facts of one step that rewards use.

    Attributes:
        before_m: meters to the target before the step.
        after_m: meters to the target after the step.
        nearest_m: meters to the nearest object after the step, as the sensors measure it.
        outcome: the outcome after the step.
    """

    before_m: float
    after_m: float
    nearest_m: float
    outcome: EpisodeOutcome


Term = Callable[[Transition], float]


def progress(step: Transition) -> float:
    """Return meters gained toward the target; negative when the robot moved away.

    Bounded by the distance driven, so standing still earns exactly 0.
    """
    return step.before_m - step.after_m


def success(step: Transition) -> float:
    """Return 1 when the robot came to stand on the target, or on the current one of several, else 0."""
    return float(step.outcome in (EpisodeOutcome.REACHED, EpisodeOutcome.DELIVERED))


def collision(step: Transition) -> float:
    """Return 1 when the robot ran into something, else 0."""
    return float(step.outcome is EpisodeOutcome.COLLIDED)


def proximity(step: Transition) -> float:
    """Return the used share of the margin around the robot, from 0 to 1 (the nearest measurable distance)."""
    used_m = MARGIN_M - step.nearest_m
    return max(0.0, used_m) / (MARGIN_M - SENSOR_RANGE_M[0])


def time_up(step: Transition) -> float:
    """Return 1 when the last step was taken and the target not reached, else 0."""
    return float(step.outcome is EpisodeOutcome.TIME_UP)


def duration(step: Transition) -> float:  # noqa: ARG001 - every term has the same form
    """Return 1 for every step, as the cost of time."""
    return 1.0


TERMS: dict[str, Term] = {
    "progress": progress,
    "success": success,
    "collision": collision,
    "proximity": proximity,
    "time_up": time_up,
    "duration": duration,
}

WEIGHTS: dict[str, dict[str, float]] = {
    "Dense": {"progress": 1.0, "success": 1.0, "collision": -1.0, "proximity": -0.1, "duration": -0.01},
    "Sparse": {"success": 1.0, "collision": -1.0, "time_up": -0.5},
}


def reward_terms(reward: str, step: Transition) -> dict[str, float]:
    """Return every term of a reward (`Dense` or `Sparse`) by name, weighted; their sum is the reward."""
    return {name: weight * TERMS[name](step) for name, weight in WEIGHTS[reward].items()}
