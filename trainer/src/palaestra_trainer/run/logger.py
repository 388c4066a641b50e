"""The curves of a run: Stable-Baselines3's logger, with the figures of the run in each of its points."""

from __future__ import annotations

from pathlib import Path

from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat

from palaestra_trainer.telemetry.metric_values import Logged
from palaestra_trainer.telemetry.progress import Progress


class CurvesLogger(Logger):
    """Writes to TensorBoard, and to the figures of /metrics.

    Args:
        folder: of TensorBoard.
        progress: the run; its scalars are recorded at each dump, which is rarer than a rollout.
    """

    def __init__(self, folder: Path, progress: Progress) -> None:
        formats = [TensorBoardOutputFormat(str(folder)), Logged(progress.figures)]
        super().__init__(str(folder), formats)
        self._progress = progress

    def dump(self, step: int = 0) -> None:
        """Write what was recorded, with the scalars of the run."""
        for name, value in self._progress.scalars().items():
            self.record(name, value)
        super().dump(step)


def hide_points(folder: Path, *, after: int) -> None:
    """Write the mark by which TensorBoard hides the points of earlier files whose step is larger."""
    from torch.utils.tensorboard.writer import SummaryWriter  # noqa: PLC0415 - most programs write no curves

    with SummaryWriter(str(folder), purge_step=after + 1):
        pass
