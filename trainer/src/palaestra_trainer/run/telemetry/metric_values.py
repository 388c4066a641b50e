"""Values of one attempt that only /metrics exports; the next attempt begins with new values."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from stable_baselines3.common.logger import KVWriter

from palaestra_protocol.metrics import Tally
from palaestra_trainer.episodes.evaluation import EvaluationResult
from palaestra_trainer.run.telemetry import metric_definitions
from palaestra_trainer.simulators.stats import SimulatorStats

EPISODES_IN_MEAN = 100  # as in Stable-Baselines3's rollout/ep_rew_mean


def _successes() -> deque[bool]:
    return deque(maxlen=EPISODES_IN_MEAN)


@dataclass(slots=True)
class MetricValues:
    """The values of one attempt; the training thread writes them, and any thread may read them.

    Attributes:
        returns: histogram of the returns of training episodes.
        lengths: histogram of the lengths of training episodes, in steps.
        successes: success of the last training episodes, if the environment reports success.
        evaluations: number of evaluations.
        evaluation: the last evaluation; None before the first evaluation.
        saves: histogram of the seconds to write a checkpoint.
        saved_at: Unix time of the newest checkpoint; None before the first checkpoint.
        saved_bytes: size of the newest checkpoint's files; None before the first checkpoint.
        saves_refused: number of checkpoints that could not be written.
        logged: the values that the learner logged last, by their names in TensorBoard.
        meters: the statistics of each simulator, by its name.
    """

    returns: Tally = field(default_factory=metric_definitions.RETURN.tally)
    lengths: Tally = field(default_factory=metric_definitions.LENGTH.tally)
    successes: deque[bool] = field(default_factory=_successes)
    evaluations: int = 0
    evaluation: EvaluationResult | None = None
    saves: Tally = field(default_factory=metric_definitions.CHECKPOINT_DURATION.tally)
    saved_at: float | None = None
    saved_bytes: int | None = None
    saves_refused: int = 0
    logged: dict[str, Any] = field(default_factory=dict)
    meters: Mapping[str, SimulatorStats] = field(default_factory=dict)

    def played(self, info: Mapping[str, Any]) -> None:
        """Count a training episode from the info of its last step."""
        self.returns.observe(info["episode"]["r"])
        self.lengths.observe(info["episode"]["l"])
        if "is_success" in info:
            self.successes.append(bool(info["is_success"]))

    def evaluated(self, evaluation: EvaluationResult) -> None:
        """Count an evaluation."""
        self.evaluation = evaluation
        self.evaluations += 1

    def saved(self, seconds: float, size_bytes: int) -> None:
        """Record the time that a checkpoint took to write, and its size."""
        self.saves.observe(seconds)
        self.saved_at, self.saved_bytes = time.time(), size_bytes


class Logged(KVWriter):
    """An output of Stable-Baselines3's logger that copies the values for TensorBoard to `figures`."""

    def __init__(self, figures: MetricValues) -> None:
        self._figures = figures

    def write(
        self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0
    ) -> None:
        """Store the newest value of each name."""
        del key_excluded, step
        self._figures.logged = {**self._figures.logged, **key_values}

    def close(self) -> None:
        """Do nothing, because this output has no file."""
