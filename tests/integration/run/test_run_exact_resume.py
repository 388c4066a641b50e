"""A run that is interrupted and goes on, with simulators that repeat themselves."""

import os
import signal

import pytest

from tests.local_run import LocalRun
from tests.soak import resume
from tests.soak.jobs import make_job

STEPS = 900  # `make soak` takes more
SEEING_STEPS = 768
SEEING = {"builtin": "seeing"}
PPO = {"n_steps": 64, "batch_size": 64, "n_epochs": 1}


@pytest.mark.parametrize("driver", ["stub", "mujoco"])
def test_an_interrupted_run_ends_as_one_that_was_not(tmp_path, monkeypatch, driver):
    """Bit for bit: its trainer is asked to end at a third; `make soak` does this for every algorithm."""
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    job = resume.job("DQN", 1)
    job["spec"]["trainer"]["steps"] = STEPS
    for group in job["spec"]["simulators"]:
        group["driver"] = driver
    assert_resumes_exactly(tmp_path, job, STEPS // 3)


def test_an_interrupted_run_that_sees_ends_as_one_that_was_not(tmp_path, monkeypatch):
    """Its observations are pictures, which a new simulator has to draw as the first one would have."""
    monkeypatch.setenv("OMP_NUM_THREADS", "1")

    assert_resumes_exactly(tmp_path, seeing(), SEEING_STEPS // 6)


def seeing():
    """Return a short job of SeeTarget-v0 with MuJoCo that evaluates and saves a few times."""
    return make_job(
        collect={"driver": "mujoco", "world": SEEING},
        evaluate={"driver": "mujoco", "world": SEEING},
        environment={"id": "SeeTarget-v0", "options": {"max_steps": 40, "cylinders": True}},
        algorithm={"name": "PPO", "cnn": "small", "hyperparameters": PPO},
        steps=SEEING_STEPS,
        evaluation={"everySteps": SEEING_STEPS // 2, "episodes": 2, "confirmEpisodes": 0},
        checkpoint={"everySteps": SEEING_STEPS // 12, "keep": 3},
    )


def assert_resumes_exactly(folder, job, step):
    """Compare a run that is asked to end past a step, and goes on, with one that is not."""
    for name in ("whole", "parts"):
        (folder / name).mkdir()
    whole, parts = (LocalRun(folder / name, job) for name in ("whole", "parts"))
    with whole:
        whole.end()

    with parts:
        parts.wait_for_step(step)
        os.kill(parts.trainer(), signal.SIGTERM)
        code, output = parts.end()

    assert code == 0, output
    first, second = parts.attempts()
    assert (first, second.rpartition(" ")[0]) == ("new run", "resumed at step")
    assert "do not repeat" not in parts.log()
    assert resume.results(parts.directory) == resume.results(whole.directory)
