"""The tracker of MLflow, with a fake of its client that keeps all data in memory."""

from __future__ import annotations

import importlib
import sys
import types
from typing import NamedTuple

import pytest
from structlog.testing import capture_logs

from palaestra_trainer.errors import ConfigurationError

CONFIGURATION = {"job": "corridor", "replica": 0, "algorithm": {"name": "PPO", "layers": [64, 64]}}


class Metric(NamedTuple):
    """A point of a curve, as in `mlflow.entities`."""

    key: str
    value: float
    timestamp: int
    step: int


class Param(NamedTuple):
    """A parameter of a run, as in `mlflow.entities`."""

    key: str
    value: str


class MlflowException(Exception):
    """The error that the client raises if the server does not respond."""


class MlflowClient:
    """A fake of the client; its server is this class.

    Attributes:
        responds: whether the server responds.
        experiments: the ids of the experiments, by their names.
        runs: the experiment and the name of each run, by its id.
        batches: the parameters or metrics of each request.
        statuses: the statuses that the runs got, in their order.
    """

    responds = True

    def __init__(self, tracking_uri):
        self.uri = tracking_uri

    def get_experiment_by_name(self, name):
        """Return an experiment; None if it does not exist."""
        known = self.experiments.get(name)
        return types.SimpleNamespace(experiment_id=known) if known else None

    def create_experiment(self, name):
        """Create an experiment; return its id."""
        return self.experiments.setdefault(name, f"experiment-{len(self.experiments)}")

    def create_run(self, experiment, run_name):
        """Create a run."""
        run = f"run-{len(self.runs)}"
        self.runs[run] = (experiment, run_name)
        return types.SimpleNamespace(info=types.SimpleNamespace(run_id=run))

    def log_batch(self, run, metrics=(), params=()):
        """Keep metrics and parameters."""
        self._request()
        self.batches.append((run, [*metrics, *params]))

    def update_run(self, run, status):
        """Keep the status of a run."""
        self._request()
        self.statuses.append((run, status))

    def set_terminated(self, run):
        """Record that the run has finished."""
        self.update_run(run, "FINISHED")

    def _request(self):
        if not self.responds:
            raise MlflowException("connection refused")


@pytest.fixture
def server(monkeypatch):
    """Return the fake of the server, without data."""
    for name, empty in (("experiments", {}), ("runs", {}), ("batches", []), ("statuses", [])):
        monkeypatch.setattr(MlflowClient, name, empty, raising=False)
    monkeypatch.setattr(MlflowClient, "responds", True)
    return MlflowClient


@pytest.fixture
def mlflow(monkeypatch, server):
    """Return the module of the tracker, imported with the fake library, for the time of the test."""
    library = {
        "mlflow": types.ModuleType("mlflow"),
        "mlflow.entities": types.SimpleNamespace(Metric=Metric, Param=Param),
        "mlflow.exceptions": types.SimpleNamespace(MlflowException=MlflowException),
        "mlflow.tracking": types.SimpleNamespace(MlflowClient=server),
    }
    for name, module in library.items():
        monkeypatch.setitem(sys.modules, name, module)
    for variable in ("MLFLOW_HTTP_REQUEST_TIMEOUT", "MLFLOW_HTTP_REQUEST_MAX_RETRIES", "MLFLOW_TRACKING_URI"):
        monkeypatch.setenv(variable, "")  # so the fixture restores what the tracker sets
        monkeypatch.delenv(variable)
    name = "palaestra_trainer.trackers.mlflow"
    monkeypatch.setitem(sys.modules, name, None)
    del sys.modules[name]
    return importlib.import_module(name)


@pytest.fixture
def begun(mlflow, directory):
    """Return a function that begins an attempt with a new tracker."""
    directory.path.mkdir(exist_ok=True)

    def begin(**options):
        tracker = mlflow.MLflow(uri="http://mlflow:5000", **options)
        tracker.begin(directory, CONFIGURATION)
        return tracker

    return begin


def test_without_an_address_the_tracker_names_its_argument_and_its_variable(mlflow, monkeypatch):
    """MLflow itself would write to a local folder, which disappears with the pod."""
    with pytest.raises(ConfigurationError, match=r"uri: is missing; give .* or set MLFLOW_TRACKING_URI"):
        mlflow.MLflow()

    monkeypatch.setenv("MLFLOW_TRACKING_URI", "http://mlflow:5000")
    mlflow.MLflow()


def test_the_first_attempt_creates_experiment_and_run_with_all_parameters(begun, server):
    """A nested field has one parameter with its path, since MLflow has no nested parameters."""
    begun(experiment="robots")

    assert server.experiments == {"robots": "experiment-0"}
    assert server.runs == {"run-0": ("experiment-0", "corridor-0")}
    assert server.statuses == [("run-0", "RUNNING")]
    assert server.batches == [
        (
            "run-0",
            [
                ("job", "corridor"),
                ("replica", "0"),
                ("algorithm.name", "PPO"),
                ("algorithm.layers", "[64, 64]"),
            ],
        )
    ]


def test_a_next_attempt_continues_the_run_and_marks_it_as_running(begun, server):
    """A second run would split the curves of one training into two halves."""
    begun().end()

    begun()

    assert list(server.runs) == ["run-0"]
    assert [status for _, status in server.statuses] == ["RUNNING", "FINISHED", "RUNNING"]


def test_a_run_is_added_to_an_experiment_that_exists(begun, server):
    """The server refuses a second experiment of the same name."""
    server.experiments["palaestra"] = "theirs"

    begun()

    assert server.runs == {"run-0": ("theirs", "corridor-0")}


def test_no_request_has_more_parameters_than_the_server_accepts(mlflow, begun, server, monkeypatch):
    """The server refuses the whole request, and the run would have no parameters at all."""
    monkeypatch.setattr(mlflow, "MOST_PARAMETERS", 3)

    begun()

    assert [len(sent) for _, sent in server.batches] == [3, 1]


def test_scalars_arrive_with_their_step(begun, server):
    """MLflow's charts use the step as the x axis, as TensorBoard does."""
    tracker = begun()

    tracker.log_scalars(40, {"eval/mean_reward": 1.5})

    run, (metric,) = server.batches[-1]
    assert (run, metric.key, metric.value, metric.step) == ("run-0", "eval/mean_reward", 1.5, 40)


def test_a_server_that_stops_responding_is_logged_once_and_does_not_end_training(begun, server):
    """A training of days is worth more than its curves; the end reports how many points are missing."""
    tracker = begun()
    server.responds = False

    with capture_logs() as lines:
        tracker.log_scalars(40, {"a": 1.0, "b": 2.0})
        tracker.log_scalars(50, {"a": 1.0})
        tracker.end()

    assert [(line["log_level"], line["event"]) for line in lines] == [
        ("warning", "MLflow does not respond: points of its charts are lost"),
        ("warning", "points are missing in MLflow"),
        ("warning", "MLflow does not respond: its run stays marked as running"),
    ]
    assert (lines[0]["step"], lines[0]["fact"]) == (40, "connection refused")
    assert lines[1]["points"] == 3
