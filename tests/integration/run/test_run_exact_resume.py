"""A run that is interrupted and resumed has the same results as an uninterrupted run, bit by bit.

The simulators are deterministic. Each variant has another world, simulator and environment. `make soak` does
this with every algorithm.
"""

import os
import signal
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.local_run import ROOT, LocalRun
from tests.pages import fenced
from tests.soak import resume
from tests.soak.jobs import tiny_job

PAGE = dict(fenced((ROOT / "docs/howto/randomization.md").read_text()))
EXAMPLES = ROOT / "examples"
SEEING = {"driver": "mujoco", "world": {"builtin": "seeing"}}
PPO = {"n_steps": 32, "batch_size": 32, "n_epochs": 1}
FEW = {"episodes": 1, "confirmEpisodes": 1}


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """A job, and the step after which its trainer is interrupted."""

    job: dict[str, Any]
    asked_at: int


def learning(environment: dict[str, Any], steps: int, driver: str) -> Variant:
    """Return a DQN training in a world that changes in every episode; learning starts at step 100."""
    job = resume.job("DQN", 1)
    job["spec"]["trainer"] |= {
        "environment": environment,
        "steps": steps,
        "evaluation": {"everySteps": steps // 2, **FEW},
        "checkpoint": {"everySteps": 50, "keep": 3},
    }
    for group in job["spec"]["simulators"]:
        group["driver"] = driver
    return Variant(job=job, asked_at=steps // 2)


def seeing() -> Variant:
    """Return a PPO training on images, which a new simulator must render exactly like the first one."""
    job = tiny_job(
        collect=SEEING,
        evaluate=SEEING,
        environment={"id": "SeeTarget-v0", "options": {"max_steps": 40, "cylinders": True}},
        algorithm={"name": "PPO", "cnn": "small", "hyperparameters": PPO},
        steps=256,
        evaluation={"everySteps": 128, **FEW},
        checkpoint={"everySteps": 32, "keep": 3},
    )
    return Variant(job=job, asked_at=100)


def copies() -> Variant:
    """Return a PPO training in four copies of the arena, whose episodes are longer than a rollout."""
    job = tiny_job(
        collect={"driver": "mujoco", "batch": 4},
        evaluate={"driver": "mujoco"},
        environment={"id": "MoveToTargetEnv-v0", "options": {"max_steps": 40}},
        algorithm={"name": "PPO", "hyperparameters": PPO},
        steps=640,
        evaluation={"everySteps": 320, **FEW},
        checkpoint={"everySteps": 128, "keep": 3},
    )
    return Variant(job=job, asked_at=300)


VARIANTS = {
    "the page's scattered cylinders": learning(
        yaml.safe_load(PAGE["yaml"])["spec"]["trainer"]["environment"], 360, "stub"
    ),
    # On resume, an episode is replayed with the training progress that was current when the episode began.
    "the example's curriculum in MuJoCo": learning(
        {"id": "curriculum:Curriculum-v0", "options": {"max_steps": 40}}, 240, "mujoco"
    ),
    "pictures of MuJoCo": seeing(),
    "copies in one MuJoCo": copies(),
}


@pytest.fixture
def modules(tmp_path, monkeypatch):
    """Put the modules of the page and of the example on the import path of every process."""
    folder = tmp_path / "modules"
    folder.mkdir()
    (folder / "scattered.py").write_text(PAGE["python in-a-job"])
    monkeypatch.setenv("PYTHONPATH", f"{folder}{os.pathsep}{EXAMPLES}")
    monkeypatch.setenv("OMP_NUM_THREADS", "1")


@pytest.mark.usefixtures("modules")
@pytest.mark.parametrize("variant", VARIANTS.values(), ids=VARIANTS)
def test_an_interrupted_run_ends_as_one_that_was_not(tmp_path, variant):
    """An interruption must not change the result of a run.

    The signal arrives during an episode, and the test compares world, experience, parameters and evaluations.
    """
    whole, parts = (begun(tmp_path / name, variant.job) for name in ("whole", "parts"))
    with whole:
        code, output = whole.end()
        assert code == 0, output

    with parts:
        parts.wait_for_step(variant.asked_at)
        os.kill(parts.trainer(), signal.SIGTERM)
        code, output = parts.end()

    assert code == 0, output
    first, second = parts.attempts()
    assert (first, second.rpartition(" ")[0]) == ("new run", "resumed at step")
    assert "do not repeat" not in parts.log()
    assert "simulator fault" not in whole.log() + parts.log()  # e.g. a step of 5 s on a busy machine
    assert resume.results(parts.directory) == resume.results(whole.directory)


def begun(folder: Path, job: dict[str, Any]) -> LocalRun:
    """Return a run of a job in a new folder, which has not been started."""
    folder.mkdir()
    return LocalRun(folder, job)
