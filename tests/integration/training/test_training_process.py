"""Signals, exit codes and resumed runs of a trainer.

A test that kills the trainer starts a separate process; other tests run the same code in this process.
"""

from __future__ import annotations

import json
import re
import signal

import pytest

from palaestra_protocol.pod.status import Termination

DEADLINE_S = 120.0
PPO = {"name": "PPO", "hyperparameters": {"n_steps": 64, "batch_size": 32, "n_epochs": 2}}
DQN = {"name": "DQN", "hyperparameters": {"learning_starts": 100, "policy_kwargs": {"net_arch": [16]}}}
REINFORCE = {"name": "REINFORCE", "hyperparameters": {"episodes_per_update": 2}}


def await_line(process, word):
    """Read the log of a process up to a line that contains `word`, and return the line."""
    for line in process.stderr:
        if word in line:
            return line
    raise AssertionError(f"the process ended without {word!r}")


def end(process):
    """Wait for the end of a process; return its exit code and the rest of its log."""
    _, log = process.communicate(timeout=DEADLINE_S)
    return process.returncode, log


def summary(folder):
    """Return the content of the run's summary.json."""
    return json.loads((folder / "run" / "summary.json").read_text())


@pytest.mark.parametrize(
    ("algorithm", "collectors", "steps"),
    [(DQN, 1, 600), (PPO, 2, None), (REINFORCE, 2, None)],
    ids=["DQN", "PPO", "REINFORCE"],
)
def test_a_run_survives_a_fault(write_job, play, tmp_path, algorithm, collectors, steps):
    """The run must complete all steps and report one fault.

    While one of two simulators restarts, each step of the other adds an invalid row to the rollout.
    """
    job = write_job(algorithm=algorithm, collectors=collectors)

    code, log = play(job, deaths=[77])

    result = summary(tmp_path)
    assert code == 0
    assert log.count("simulator fault") == 1
    assert (result["faults"], result["restarts"]) == (1, 1)
    assert result["steps"] == steps if steps else result["steps"] >= 600
    assert (tmp_path / "run" / "model.zip").exists()


@pytest.mark.parametrize(
    ("algorithm", "total", "number"),
    [(DQN, 1200, signal.SIGINT), (PPO, 1216, signal.SIGTERM)],
    ids=["DQN", "PPO"],
)
def test_an_interrupted_run_ends_at_the_total_of_an_uninterrupted_one(
    write_job, play, tmp_path, algorithm, total, number
):
    """After Ctrl-C, the same command must continue from the checkpoint and end at the same step."""
    job = write_job(algorithm=algorithm, steps=1200)
    code, _ = play(job, at=400, number=number)
    word = Termination.from_message((tmp_path / "word").read_text())

    again, log = play(job)

    assert (code, again) == (75, 0)
    assert word.reason == f"Interrupted: {number.name} received"
    assert 0 < word.last_checkpoint.step < total
    assert f"resumed at step {word.last_checkpoint.step}" in log
    assert summary(tmp_path)["steps"] == total
    assert summary(tmp_path)["attempts"] == 2


def test_a_killed_run_goes_on_from_its_newest_checkpoint(write_job, start, play, tmp_path):
    """A node that fails sends no signal first, so the trainer cannot save a checkpoint."""
    job = write_job(algorithm=DQN, steps=800)
    first = start(job)
    await_line(first, "checkpoint written")
    first.kill()
    end(first)

    code, log = play(job)

    assert code == 0
    assert "resumed at step" in log
    assert summary(tmp_path)["steps"] == 800


def test_a_run_that_diverges_says_where_and_keeps_its_last_good_checkpoint(write_job, play, tmp_path):
    """With exit code 81 the operator does not retry, because every attempt would diverge again."""
    wild = {"learning_starts": 100, "learning_rate": float("inf"), "policy_kwargs": {"net_arch": [16]}}
    job = write_job(
        algorithm={"name": "DQN", "hyperparameters": wild}, checkpoint={"everySteps": 100, "keep": 3}
    )

    code, log = play(job)

    word = Termination.from_message((tmp_path / "word").read_text())
    assert code == 81, log
    assert re.match(r"Diverged: step 1\d\d: (train/loss is|q_net\S* holds) \S+", word.reason)
    assert word.reason.removeprefix("Diverged: ")[:40] in word.log[-1]
    assert (word.step, word.last_checkpoint.step) == (int(word.reason.split()[2][:-1]), 100)
    assert [path.name for path in (tmp_path / "run" / "checkpoints").iterdir()] == ["100"]


def test_ctrl_c_does_not_wait_for_a_simulator_that_starts(write_job, start):
    """The user has no results to save, and a start may take minutes."""
    process = start(write_job(), deaths="0")
    await_line(process, "never comes up")
    process.send_signal(signal.SIGINT)

    code, log = end(process)

    assert code == 75, log
    assert "Interrupted" in log


def test_a_second_signal_ends_the_process_at_once(write_job, start):
    """A user who types Ctrl-C twice does not want to wait for the end of an update."""
    endless = {"name": "PPO", "hyperparameters": {"n_steps": 64, "batch_size": 32, "n_epochs": 100_000}}
    process = start(write_job(algorithm=endless))
    await_line(process, "training")
    process.send_signal(signal.SIGINT)
    await_line(process, "a second signal ends at once")
    process.send_signal(signal.SIGINT)

    code, _ = end(process)

    assert code == -signal.SIGINT
