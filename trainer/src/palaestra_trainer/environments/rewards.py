"""The reward of a step: a weighted sum of small named terms.

A term is a pure function of one transition with a known range. `WEIGHTS` has the weight of each term. An
environment reports every weighted term by name, so curves in TensorBoard show from which terms a policy gets
its reward.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from palaestra_trainer.robots.base import SENSOR_RANGE_M

MARGIN_M = 0.18  # free space to keep around the robot, which drives about half of this distance in a step


class EpisodeOutcome(Enum):
    """The outcome of a step: how the episode ended, or that it continues."""

    RUNNING = "running"
    DELIVERED = "delivered"
    REACHED = "reached"
    COLLIDED = "collided"
    TIME_UP = "time_up"

    @property
    def terminal(self) -> bool:
        """Whether the task itself ended: the robot reached the last target or collided."""
        return self in (EpisodeOutcome.REACHED, EpisodeOutcome.COLLIDED)


@dataclass(frozen=True, slots=True, kw_only=True)
class Transition:
    """The values of one step from which rewards are computed.

    Attributes:
        before_m: meters to the target before the step.
        after_m: meters to the target after the step.
        nearest_m: meters to the nearest object after the step, as the robot's sensors measure it.
        outcome: how the episode ended in the step, or that the episode continues.
    """

    before_m: float
    after_m: float
    nearest_m: float
    outcome: EpisodeOutcome


Term = Callable[[Transition], float]


def progress(step: Transition) -> float:
    """Return the meters that the robot came nearer to the target; negative if it moved away.

    The value is at most the distance driven, so standing still earns exactly 0.
    """
    return step.before_m - step.after_m


def success(step: Transition) -> float:
    """Return 1 if the robot came to stand on the current target, else 0."""
    return float(step.outcome in (EpisodeOutcome.REACHED, EpisodeOutcome.DELIVERED))


def collision(step: Transition) -> float:
    """Return 1 if the robot ran into an object, else 0."""
    return float(step.outcome is EpisodeOutcome.COLLIDED)


def proximity(step: Transition) -> float:
    """Return 0 if no object is inside the margin, and up to 1 at the nearest measurable distance."""
    used_m = MARGIN_M - step.nearest_m
    return max(0.0, used_m) / (MARGIN_M - SENSOR_RANGE_M[0])


def time_up(step: Transition) -> float:
    """Return 1 if time is up and the robot has neither reached the target nor collided, else 0."""
    return float(step.outcome is EpisodeOutcome.TIME_UP)


def duration(step: Transition) -> float:  # noqa: ARG001 - every term has the same form
    """Return 1 for every step; the weight is negative, so each step reduces the reward."""
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
    """Return the weighted terms of `Dense` or `Sparse` by name; the sum of the terms is the reward."""
    return {name: weight * TERMS[name](step) for name, weight in WEIGHTS[reward].items()}
