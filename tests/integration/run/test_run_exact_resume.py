"""A run that is interrupted and goes on, with simulators that repeat themselves."""

import os
import signal

import pytest

from tests.local_run import LocalRun
from tests.soak import resume

STEPS = 900  # `make soak` takes more


@pytest.mark.parametrize("driver", ["stub", "mujoco"])
def test_an_interrupted_run_ends_as_one_that_was_not(tmp_path, monkeypatch, driver):
    """Bit for bit: its trainer is asked to end at a third; `make soak` does this for every algorithm."""
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    job = resume.job("DQN", 1)
    job["spec"]["trainer"]["steps"] = STEPS
    for group in job["spec"]["simulators"]:
        group["driver"] = driver
    for name in ("whole", "parts"):
        (tmp_path / name).mkdir()
    whole, parts = (LocalRun(tmp_path / name, job) for name in ("whole", "parts"))
    with whole:
        whole.end()

    with parts:
        parts.wait_for_step(STEPS // 3)
        os.kill(parts.trainer(), signal.SIGTERM)
        code, output = parts.end()

    assert code == 0, output
    first, second = parts.attempts()
    assert (first, second.rpartition(" ")[0]) == ("new run", "resumed at step")
    assert "do not repeat" not in parts.log()
    assert resume.results(parts.directory) == resume.results(whole.directory)
