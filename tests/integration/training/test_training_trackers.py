"""Runs with fake simulators and the real libraries of trackers; MLflow has a real server."""

from __future__ import annotations

import importlib.util
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from tests.waiting import eventually

INSTALL = "install both libraries with: uv pip install --group trackers"
PPO = {"name": "PPO", "hyperparameters": {"n_steps": 64, "batch_size": 32, "n_epochs": 1}}
FEW = {"everySteps": 200, "episodes": 2, "confirmEpisodes": 2}


@pytest.fixture
def interrupted_and_resumed(write_job, play, tmp_path):
    """Return a function that runs a job with a tracker, in two attempts, and returns the run directory."""

    def run(name, **options):
        algorithm = PPO | {"callbacks": [{"name": name, "options": options}]}
        job = write_job(algorithm=algorithm, steps=400, evaluation=FEW)
        first, log = play(job, at=300, number=signal.SIGTERM)
        second, log = play(job)
        assert (first, second) == (75, 0), log
        return tmp_path / "run"

    return run


def curve(run: Path, name: str) -> dict[int, float]:
    """Return a curve in TensorBoard, by step.

    Evaluations log some values twice, and the last value counts.
    """
    points = EventAccumulator(str(run / "tensorboard")).Reload().Scalars(name)
    return {point.step: pytest.approx(point.value, rel=1e-5) for point in points}


def records(path: Path) -> Iterator[bytes]:
    """Yield the records of a W&B file, which is a header and a LevelDB log in blocks of 32 KiB."""
    content, place, parts = path.read_bytes(), 7, b""
    while place + 7 <= len(content):
        if 32768 - place % 32768 < 7:
            place += 32768 - place % 32768
            continue
        length, kind = struct.unpack("<HB", content[place + 4 : place + 7])
        parts += content[place + 7 : place + 7 + length]
        place += 7 + length
        if kind in {1, 4}:  # a whole record, or the last part of a record
            yield parts
            parts = b""


def test_wandb_writes_both_attempts_as_one_run_with_the_curves_of_tensorboard(
    interrupted_and_resumed, monkeypatch, tmp_path
):
    """The test is offline, as in a pod: no network, no account, and a home that is not writable."""
    messages = pytest.importorskip("wandb.proto.wandb_internal_pb2", reason=INSTALL)
    monkeypatch.setenv("HOME", str(tmp_path / "none" / "such"))
    run = interrupted_and_resumed("palaestra_trainer.trackers.wandb:Wandb", project="corridors")

    files = sorted(run.glob("wandb/offline-run-*/*.wandb"))
    read = [messages.Record.FromString(record) for file in files for record in records(file)]
    begun = [record.run for record in read if record.HasField("run")]
    config = {item.key: json.loads(item.value_json) for item in begun[0].config.update}
    points = {}
    for record in read:
        row = {item.key or item.nested_key[0]: json.loads(item.value_json) for item in record.history.item}
        points |= {(name, row["step"]): value for name, value in row.items()}
    assert len(files) == 2
    assert {(item.project, item.run_id) for item in begun} == {("corridors", begun[0].run_id)}
    assert (config["job"], config["algorithm"]["hyperparameters"]["gamma"]) == ("fakes", 0.97)
    for name in ("eval/mean_reward", "train/loss", "rollout/ep_len_mean"):
        assert {step: points[name, step] for step in curve(run, name)} == curve(run, name)


@pytest.fixture
def server(tmp_path):
    """Start an MLflow server, and yield its address."""
    if not (importlib.util.find_spec("mlflow") and importlib.util.find_spec("flask")):
        pytest.skip(INSTALL)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"http://127.0.0.1:{port}"
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "mlflow", "server", "--host", "127.0.0.1", "--port", str(port)),
            *("--backend-store-uri", f"sqlite:///{tmp_path}/mlflow.db", "--workers", "1"),
            *("--default-artifact-root", str(tmp_path / "artifacts")),
        ],
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    eventually(lambda: _answers(f"{address}/health"), deadline_s=120)
    yield address
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _answers(url: str) -> bool:
    try:
        with urllib.request.urlopen(url, timeout=5) as answer:
            return answer.status == 200
    except OSError:
        return False


def test_mlflow_has_both_attempts_as_one_run_with_the_curves_of_tensorboard(server, interrupted_and_resumed):
    """MLflow's client cannot store runs without a server, so this test starts a server."""
    tracking = pytest.importorskip("mlflow.tracking", reason=INSTALL)
    run = interrupted_and_resumed("palaestra_trainer.trackers.mlflow:MLflow", uri=server)

    client = tracking.MlflowClient(tracking_uri=server)
    experiment = client.get_experiment_by_name("palaestra")
    found = client.search_runs([experiment.experiment_id])
    assert [each.info.status for each in found] == ["FINISHED"]
    assert found[0].data.params["algorithm.hyperparameters.gamma"] == "0.97"
    for name in ("eval/mean_reward", "train/loss", "rollout/ep_len_mean"):
        points = client.get_metric_history(found[0].info.run_id, name)
        history = {point.step: point.value for point in sorted(points, key=lambda point: point.timestamp)}
        assert {step: history[step] for step in curve(run, name)} == curve(run, name)


def test_a_server_that_does_not_answer_ends_an_attempt_with_the_callback_s_name(write_job, play, monkeypatch):
    """The run must fail at its start, because its curves would otherwise be missing at its end."""
    pytest.importorskip("mlflow", reason=INSTALL)
    monkeypatch.setenv("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "0")
    callback = {"name": "palaestra_trainer.trackers.mlflow:MLflow", "options": {"uri": "http://127.0.0.1:9"}}

    code, log = play(write_job(algorithm=PPO | {"callbacks": [callback]}))

    assert code == 1
    assert "callback palaestra_trainer.trackers.mlflow:MLflow: raised MlflowException" in log
