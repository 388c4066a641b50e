"""The options that a run passes to every reset: the number of the episode and the training progress."""

from __future__ import annotations

from typing import Any

EVALUATING = 1.0  # training progress in an evaluation, which plays the task as at the end of training


def reset_options(training_progress: float, episode: int) -> dict[str, Any]:
    """Return the options of a reset.

    Args:
        training_progress: steps of the run before the episode, divided by the steps of the whole run; 0 to 1.
        episode: number of the episode in its simulator or in its evaluation, counted from 0.
    """
    return {"training_progress": training_progress, "episode": episode}
