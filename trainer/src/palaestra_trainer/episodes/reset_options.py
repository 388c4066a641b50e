"""The position of an episode in its run, which every reset of an environment gets as options."""

from __future__ import annotations

from typing import Any

EVALUATING = 1.0  # evaluations measure the whole task, at any time


def reset_options(training_progress: float, episode: int) -> dict[str, Any]:
    """Return the options of a reset.

    Args:
        training_progress: steps learned from when the episode begins, divided by the run's steps; 0 to 1.
        episode: number of the episode, counted from 0: in its simulator, or in its evaluation.
    """
    return {"training_progress": training_progress, "episode": episode}
