"""The options of every reset of an environment: the position of the episode in its run."""

from __future__ import annotations

from typing import Any

EVALUATING = 1.0  # an evaluation measures the whole task, whenever it runs


def reset_options(training_progress: float, episode: int) -> dict[str, Any]:
    """Return the options of a reset.

    Args:
        training_progress: steps learned from before the episode, divided by the run's steps; 0 to 1.
        episode: number of the episode, counted from 0: in its simulator, or in its evaluation.
    """
    return {"training_progress": training_progress, "episode": episode}
