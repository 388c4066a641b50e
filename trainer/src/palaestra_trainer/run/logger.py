"""Log the curves of a run: a logger of Stable-Baselines3 that adds the scalars of the run."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat

from palaestra_trainer.run.telemetry.metric_values import Logged
from palaestra_trainer.run.telemetry.progress import Progress

_RGB = 3  # Summary.Image.colorspace; source: tensorflow/core/framework/summary.proto


class CurvesLogger(Logger):
    """A logger that writes to TensorBoard and to the values of /metrics.

    Args:
        folder: the folder of TensorBoard's event files.
        progress: the progress of the run; its scalars are recorded at each dump.
    """

    def __init__(self, folder: Path, progress: Progress) -> None:
        self._curves = TensorBoardOutputFormat(str(folder))
        super().__init__(str(folder), [self._curves, Logged(progress.figures)])
        self._progress = progress

    def dump(self, step: int = 0) -> None:
        """Write the recorded values, with the scalars of the run."""
        for name, value in self._progress.scalars().items():
            self.record(name, value)
        super().dump(step)

    def show(self, films: Mapping[str, bytes], step: int) -> None:
        """Write animated GIFs by name, as images of TensorBoard.

        SummaryWriter would write each picture as a PNG, so this method creates the summaries.
        """
        summary = import_module("tensorboard.compat.proto.summary_pb2").Summary  # slow to import
        images = {
            name: summary.Image(encoded_image_string=film, colorspace=_RGB) for name, film in films.items()
        }
        values = [summary.Value(tag=name, image=image) for name, image in images.items()]
        writer = self._curves.writer.file_writer  # None after the logger was closed
        if values and writer is not None:
            writer.add_summary(summary(value=values), step)
            writer.flush()


def hide_points(folder: Path, *, after: int) -> None:
    """Make TensorBoard hide the points of earlier files after the step `after`."""
    from torch.utils.tensorboard.writer import SummaryWriter  # noqa: PLC0415 - most programs write no curves

    with SummaryWriter(str(folder), purge_step=after + 1):
        pass
