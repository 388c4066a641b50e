"""Send curves to an MLflow server, by the client of `mlflow-skinny`; this client has no local store."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator, Mapping
from typing import Any

import structlog
from mlflow.entities import Metric, Param
from mlflow.exceptions import MlflowException
from mlflow.tracking import MlflowClient

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.trackers.tracker import Tracker, known_run, remember_run, title_of

log = structlog.get_logger(__name__)

NAME = "mlflow"
URI_VARIABLE = "MLFLOW_TRACKING_URI"
# With the client's default timeouts, a server that does not respond would block training for minutes.
PATIENCE = {"MLFLOW_HTTP_REQUEST_TIMEOUT": "10", "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "2"}
MOST_PARAMETERS = 100  # the server's limit for one request
LONGEST_PARAMETER = 6000


class MLflow(Tracker):
    """Sends the curves of a run to an MLflow server.

    The server must respond when an attempt begins. If the server does not respond later, points of the curves
    are lost and training continues.

    Args:
        uri: address of the server; None: the value of the variable MLFLOW_TRACKING_URI.
        experiment: experiment of the run; the tracker creates a missing experiment.
    """

    def __init__(self, uri: str | None = None, experiment: str = "palaestra") -> None:
        super().__init__()
        self._uri = uri or os.environ.get(URI_VARIABLE)
        if not self._uri:
            raise ConfigurationError(
                f"uri: is missing; give the address of the server, or set {URI_VARIABLE}"
            )
        self._experiment = experiment
        self._lost = 0

    def begin(self, directory: RunDirectory, configuration: Mapping[str, Any]) -> None:
        """Create the run with its parameters, or continue the run of an earlier attempt."""
        for name, value in PATIENCE.items():
            os.environ.setdefault(name, value)
        self._client = MlflowClient(tracking_uri=self._uri)
        known = known_run(directory, NAME)
        self._run = known or self._create(configuration)
        remember_run(directory, NAME, self._run)
        self._client.update_run(self._run, status="RUNNING")

    def log_scalars(self, step: int, scalars: Mapping[str, float]) -> None:
        """Send the scalars; if the request fails, the scalars are lost, and the first failure is logged."""
        now_ms = int(time.time() * 1000)
        metrics = [Metric(name, value, now_ms, step) for name, value in scalars.items()]
        try:
            self._client.log_batch(self._run, metrics=metrics)
        except MlflowException as error:
            if not self._lost:
                log.warning(
                    "MLflow does not respond: points of its charts are lost", step=step, fact=str(error)
                )
            self._lost += len(metrics)

    def end(self) -> None:
        """Mark the run as finished; a next attempt marks the run as running again."""
        if self._lost:
            log.warning("points are missing in MLflow", points=self._lost)
        try:
            self._client.set_terminated(self._run)
        except MlflowException as error:
            log.warning("MLflow does not respond: its run stays marked as running", fact=str(error))

    def _create(self, configuration: Mapping[str, Any]) -> str:
        found = self._client.get_experiment_by_name(self._experiment)
        experiment = found.experiment_id if found else self._client.create_experiment(self._experiment)
        run = self._client.create_run(experiment, run_name=title_of(configuration))
        parameters = [Param(name, value[:LONGEST_PARAMETER]) for name, value in flat(configuration)]
        for start in range(0, len(parameters), MOST_PARAMETERS):
            self._client.log_batch(run.info.run_id, params=parameters[start : start + MOST_PARAMETERS])
        return str(run.info.run_id)


def flat(configuration: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield path and text of each value, such as `algorithm.name`; a list is one value."""
    for name, value in configuration.items():
        if isinstance(value, Mapping):
            yield from flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value if isinstance(value, str) else json.dumps(value)
