"""The base of all trackers; it selects the scalars to send, and stores the id of the tracker's run.

A tracker gets each scalar that TensorBoard gets, at the same step. The file `trackers.json` of the run
directory holds the id of the tracker's run. So every attempt continues the same run of the tracker.
"""

from __future__ import annotations

import json
from abc import abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import KVWriter

from palaestra_protocol.whole_file import replace_file
from palaestra_trainer.job.run_directory import RunDirectory

TENSORBOARD = "tensorboard"  # the name by which a logged value can exclude TensorBoard


class Tracker(BaseCallback):
    """A callback that sends all scalars of a run to a tracker."""

    def __init__(self) -> None:
        super().__init__()
        self._scalars = Scalars(self.log_scalars)

    @abstractmethod
    def begin(self, directory: RunDirectory, configuration: Mapping[str, Any]) -> None:
        """Begin the tracker's run; if `directory` has the id of a run, continue that run."""

    @abstractmethod
    def log_scalars(self, step: int, scalars: Mapping[str, float]) -> None:
        """Send the scalars of one step, under their names in TensorBoard."""

    @abstractmethod
    def end(self) -> None:
        """End the tracker's run for this attempt."""

    def _on_training_start(self) -> None:
        directory = RunDirectory(Path(self.logger.get_dir() or "").parent)
        self.begin(directory, configuration_of(directory))
        self.logger.output_formats.append(self._scalars)

    def _on_step(self) -> bool:
        return True

    def _on_training_end(self) -> None:
        if self._scalars in self.logger.output_formats:
            self.logger.output_formats.remove(self._scalars)
            self.end()


class Scalars(KVWriter):
    """An output of Stable-Baselines3's logger that calls `send` with the scalars of each dump."""

    def __init__(self, send: Callable[[int, Mapping[str, float]], None]) -> None:
        self._send = send

    def write(
        self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0
    ) -> None:
        """Send the numbers that TensorBoard plots; texts, images and videos are omitted."""
        scalars = {
            name: float(value)
            for name, value in key_values.items()
            if isinstance(value, int | float | np.number)
            and TENSORBOARD not in (key_excluded.get(name) or ())
        }
        if scalars:
            self._send(step, scalars)

    def close(self) -> None:
        """Do nothing, because the tracker ends its run itself."""


def configuration_of(directory: RunDirectory) -> dict[str, Any]:
    """Return the configuration in a run directory as plain data, with all hyperparameters."""
    content: dict[str, Any] = yaml.safe_load(directory.configuration.read_text(encoding="utf-8"))
    hyperparameters = json.loads(directory.hyperparameters.read_text(encoding="utf-8"))
    return content | {"algorithm": content["algorithm"] | {"hyperparameters": hyperparameters}}


def title_of(configuration: Mapping[str, Any]) -> str:
    """Return a readable name for a run: the job and the number of the replica."""
    return f"{configuration['job']}-{configuration['replica']}"


def known_run(directory: RunDirectory, tracker: str) -> str | None:
    """Return the id of the tracker's run for a run directory; None if the tracker has no run yet."""
    known = _known(directory)
    return known.get(tracker)


def remember_run(directory: RunDirectory, tracker: str, run: str) -> None:
    """Store the id of the tracker's run in a run directory."""
    text = json.dumps(_known(directory) | {tracker: run}) + "\n"
    replace_file(directory.trackers, lambda path: path.write_text(text, encoding="utf-8"))


def _known(directory: RunDirectory) -> dict[str, str]:
    if not directory.trackers.exists():
        return {}
    known: dict[str, str] = json.loads(directory.trackers.read_text(encoding="utf-8"))
    return known
