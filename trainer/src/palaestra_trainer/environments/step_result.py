"""Build the result of a step for every task: reward, terminated, truncated and info."""

from __future__ import annotations

from typing import Any

from palaestra_trainer.environments.infos import OURS
from palaestra_trainer.environments.options import Episodes, time_up_terminates
from palaestra_trainer.environments.rewards import EpisodeOutcome, Transition, reward_terms

Result = tuple[float, bool, bool, dict[str, Any]]


def result(step: Transition, options: Episodes, extra_steps: int) -> Result:
    """Return reward, terminated, truncated and info of a step.

    Args:
        step: distances and outcome of the step.
        options: options of the task, which hold the rewards.
        extra_steps: control periods that the step waited for a late sensor.
    """
    outcome, terms = step.outcome, reward_terms(options.reward, step)
    info = {
        "is_success": outcome is EpisodeOutcome.REACHED,
        "outcome": outcome.value,
        "reward_terms": terms,
        OURS: {"extra_steps": extra_steps},
    }
    time_up, terminates = outcome is EpisodeOutcome.TIME_UP, time_up_terminates(options)
    terminated = outcome.terminal or (time_up and terminates)
    return sum(terms.values()), terminated, time_up and not terminates, info
