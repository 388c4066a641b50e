"""A trainer as a process: signals, exit codes, resumed runs.

Where a test kills the trainer, it starts a separate process; elsewhere it runs the same program in this one.
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
    """Read the process's log up to a line with `word`."""
    for line in process.stderr:
        if word in line:
            return line
    raise AssertionError(f"the process ended without {word!r}")


def end(process):
    """Return the process's exit code and the rest of its log."""
    _, log = process.communicate(timeout=DEADLINE_S)
    return process.returncode, log


def summary(folder):
    """Return the contents of the run's summary.json."""
    return json.loads((folder / "run" / "summary.json").read_text())


@pytest.mark.parametrize(
    ("algorithm", "collectors", "steps"),
    [(DQN, 1, 600), (PPO, 2, None), (REINFORCE, 2, None)],
    ids=["DQN", "PPO", "REINFORCE"],
)
def test_a_run_survives_a_fault(write_job, play, tmp_path, algorithm, collectors, steps):
    """It ends with 0 after all of its steps, and reports one fault.

    A rollout of two simulators has one invalid row for each step of the other simulator during the repair.
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
    """Ctrl-C comes after a third of the steps; the same command then continues from the checkpoint's step."""
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
    """A node that fails sends no signal before."""
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
    """The exit code is 81, because no attempt from there would do better."""
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
    """There is nothing to save yet, and the start may take minutes."""
    process = start(write_job(), deaths="0")
    await_line(process, "never comes up")
    process.send_signal(signal.SIGINT)

    code, log = end(process)

    assert code == 75, log
    assert "Interrupted" in log


def test_a_second_signal_ends_the_process_at_once(write_job, start):
    """A user who presses Ctrl-C twice does not want to wait until a long rollout is learned."""
    endless = {"name": "PPO", "hyperparameters": {"n_steps": 64, "batch_size": 32, "n_epochs": 100_000}}
    process = start(write_job(algorithm=endless))
    await_line(process, "training")
    process.send_signal(signal.SIGINT)
    await_line(process, "a second signal ends at once")
    process.send_signal(signal.SIGINT)

    code, _ = end(process)

    assert code == -signal.SIGINT
