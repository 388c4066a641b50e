"""Trainings with fake simulators, in this process or in a separate program that imports PyTorch first."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml

from palaestra_trainer.job.configuration import load
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run import attempt as run_attempt
from palaestra_trainer.run.telemetry.logs import configure_logs
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher

PROGRAM = Path(__file__).with_name("fakes.py")
ROLES = {"collect-0": "Collect", "collect-1": "Collect", "evaluate-0": "Evaluate"}


@pytest.fixture(scope="session")
def fakes() -> ModuleType:
    """Return the module of the fake simulators; the module is also a program."""
    spec = importlib.util.spec_from_file_location("fakes", PROGRAM)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def write_job(tmp_path):
    """Return a function that writes a training.yaml; a test passes only the fields that it needs."""

    def write(*, collectors: int = 1, **changes: Any) -> Path:
        groups = [("collect", "Collect", index) for index in range(collectors)]
        content = {
            "job": "fakes",
            "seed": 3,
            "environment": {"id": "MoveToTargetEnv-v0", "options": {"max_steps": 30}},
            "steps": 600,
            "evaluation": {"everySteps": 200, "episodes": 4, "confirmEpisodes": 4},
            "checkpoint": {"everySteps": 200, "keep": 3},
            "statusAddress": "127.0.0.1:0",
            "simulators": [
                {"name": f"{group}-{index}", "group": group, "index": index, "role": role}
                for group, role, index in [*groups, ("evaluate", "Evaluate", 0)]
            ],
        }
        path = tmp_path / "training.yaml"
        path.write_text(yaml.safe_dump(content | changes))
        return path

    return write


@pytest.fixture
def play(fakes, tmp_path, monkeypatch, capsys):
    """Return a function that runs an attempt in this process and returns exit code and log.

    The first simulator dies at the steps `deaths`. At its step `at`, this process gets the signal `number`.
    """
    monkeypatch.setenv("PALAESTRA_TERMINATION_LOG", str(tmp_path / "word"))
    configure_logs()

    def attempt(job: Path, deaths=(), at=0, number=0) -> tuple[int, str]:
        def make_members(given):
            members = fakes.make_members(given, deaths)
            fakes.before_step(members[0].robot, at, lambda: os.kill(os.getpid(), number))
            return members

        code = run_attempt.run(load(job), RunDirectory(tmp_path / "run"), make_members)
        return code, capsys.readouterr().err

    return attempt


@pytest.fixture
def start(tmp_path):
    """Yield a function that starts the program with a configuration; all programs are killed at the end."""
    started = []

    def begin(job: Path, deaths: str = "") -> subprocess.Popen[str]:
        environment = os.environ | {
            "OMP_NUM_THREADS": "1",
            "PALAESTRA_TERMINATION_LOG": str(tmp_path / "word"),
        }
        process = subprocess.Popen(
            [sys.executable, PROGRAM, job, tmp_path / "run", deaths],
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
        )
        started.append(process)
        return process

    yield begin
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture
def simulators(master, tmp_path, monkeypatch):
    """Yield the sidecars of a job with two collecting simulators and one for evaluation.

    The variable PALAESTRA_CONFIG names the job's file.
    """
    del master
    launchers = {
        name: ProcessLauncher(
            "arena",
            names=(
                "--job=vectors",
                f"--uid={tmp_path}",
                f"--group={name[:-2]}",
                f"--index={name[-1]}",
                f"--work={tmp_path / name}",
            ),
        )
        for name in ROLES
    }
    job = {
        "job": "vectors",
        "environment": {"id": "MoveToTargetEnv-v0"},
        "steps": 100,
        "statusAddress": "127.0.0.1:0",
        "simulators": [
            {"name": n, "group": n[:-2], "index": int(n[-1]), "role": role, "control": launchers[n].address}
            for n, role in ROLES.items()
        ],
    }
    (tmp_path / "training.yaml").write_text(yaml.safe_dump(job))
    monkeypatch.setenv("PALAESTRA_CONFIG", str(tmp_path / "training.yaml"))
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path))
    yield launchers
    for launcher in launchers.values():
        launcher.close()
