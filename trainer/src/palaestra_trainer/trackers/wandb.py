"""Log curves with Weights & Biases, by default offline to files that `wandb sync` uploads later."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from typing import Any

import structlog
import wandb

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.trackers.tracker import Tracker, known_run, remember_run, title_of

log = structlog.get_logger(__name__)

NAME = "wandb"
MODES = ("offline", "online")
# This time is the default grace period minus the time for the simulators and the checkpoint, see
# `waiting.shutdown_deadline`.
FINISH_S = 5


class Wandb(Tracker):
    """Sends the curves of a run to Weights & Biases.

    Args:
        project: name of the project, at Weights & Biases, to which the run is added.
        mode: `offline` only writes files in the run directory; `online` also uploads, and needs WANDB_API_KEY
            and network access.
        entity: user or team of the project; None: the default of the account.
    """

    def __init__(self, project: str = "palaestra", mode: str = MODES[0], entity: str | None = None) -> None:
        super().__init__()
        if mode not in MODES:
            raise ConfigurationError(f"mode: {mode!r} is not a mode; use {' or '.join(MODES)}")
        self._project, self._mode, self._entity = project, mode, entity
        self._step = 0

    def begin(self, directory: RunDirectory, configuration: Mapping[str, Any]) -> None:
        """Begin the run, or continue it with the same id; attempts with one id are uploaded as one run."""
        run = known_run(directory, NAME)
        if run is None:
            run = secrets.token_hex(4)
            remember_run(directory, NAME, run)
        self._directory = directory
        self._run = wandb.init(
            project=self._project,
            entity=self._entity,
            mode=self._mode,
            id=run,
            resume="allow",
            name=title_of(configuration),
            group=configuration["job"],
            config=dict(configuration),
            dir=str(directory.path),
            # The console is off, because the pod's log has the output. Git is disabled, because it may not be
            # installed.
            settings=wandb.Settings(
                console="off",
                disable_git=True,
                silent=True,
                finish_timeout=FINISH_S,
                finish_timeout_raises=True,
            ),
        )
        self._run.define_metric("step")
        self._run.define_metric("*", step_metric="step")

    def log_scalars(self, step: int, scalars: Mapping[str, float]) -> None:
        """Log the scalars with `step` as the x axis; W&B ignores values at a step below its last step."""
        self._step = max(self._step, step)
        self._run.log({**scalars, "step": step}, step=self._step)

    def end(self) -> None:
        """Write the buffered data, upload for some seconds, and end W&B's process."""
        try:
            self._run.finish()
        except TimeoutError:
            log.warning(
                "W&B has not received all data of the run in time",
                waited_s=FINISH_S,
                remedy=f"wandb sync {self._directory.path}/wandb/run-*",
            )
