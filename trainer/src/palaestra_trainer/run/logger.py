"""The curves of a run: Stable-Baselines3's logger, with the scalars of the run in each of its points."""

from __future__ import annotations

from pathlib import Path

from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat

from palaestra_trainer.telemetry.metric_values import Logged
from palaestra_trainer.telemetry.progress import Progress


class CurvesLogger(Logger):
    """Writes to TensorBoard, and to the values of /metrics.

    Args:
        folder: the folder of TensorBoard's event files.
        progress: the run; its scalars are recorded at each dump, which is less frequent than a rollout.
    """

    def __init__(self, folder: Path, progress: Progress) -> None:
        formats = [TensorBoardOutputFormat(str(folder)), Logged(progress.figures)]
        super().__init__(str(folder), formats)
        self._progress = progress

    def dump(self, step: int = 0) -> None:
        """Write the recorded values, with the scalars of the run."""
        for name, value in self._progress.scalars().items():
            self.record(name, value)
        super().dump(step)


def hide_points(folder: Path, *, after: int) -> None:
    """Write the event by which TensorBoard hides points of earlier files with a step larger than `after`."""
    from torch.utils.tensorboard.writer import SummaryWriter  # noqa: PLC0415 - most programs write no curves

    with SummaryWriter(str(folder), purge_step=after + 1):
        pass
