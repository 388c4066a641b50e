"""The first cause decides how a run ends, even if code of the job's author fails or ends the program."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from stable_baselines3.common.callbacks import BaseCallback

from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run import attempt
from palaestra_trainer.run.exit import leave_after

AT_STEP = 5


class Task(gymnasium.Env):
    """A task that calls a function at one step, and another function when it is closed."""

    observation_space = spaces.Box(-1, 1, (1,), np.float32)
    action_space = spaces.Discrete(2)

    def __init__(self, amid, at_close):
        self.amid, self.at_close, self.closed, self.taken = amid, at_close, False, 0

    def reset(self, *, seed=None, options=None):
        """Begin an episode."""
        super().reset(seed=seed, options=options)
        return np.zeros(1, np.float32), {}

    def step(self, action):
        """Take a step; at step `AT_STEP`, call the function first."""
        del action
        self.taken += 1
        numbers = np.zeros(1, np.float32)
        if self.taken == AT_STEP and self.amid:
            numbers = self.amid() or numbers
        return numbers, 0.0, self.taken % 4 == 0, False, {}

    def close(self):
        """Record that the task is closed, and call the function."""
        self.closed = True
        self.at_close()


class Leaves(BaseCallback):
    """A callback that ends the program with exit code 0."""

    def _on_step(self):
        sys.exit(0)


def fails():
    """Raise an error, as an environment's `close` may."""
    raise RuntimeError("my close failed")


def leaves():
    """End the program with exit code 0."""
    sys.exit(0)


def diverges():
    """Return an observation with NaN."""
    return np.full(1, np.nan, np.float32)


def breaks():
    """Raise an error, as an environment's `step` may."""
    raise RuntimeError("my first cause")


def is_asked_to_end():
    """Send SIGTERM to this process."""
    os.kill(os.getpid(), signal.SIGTERM)


@pytest.fixture
def play(make_member, make_configuration, tmp_path, monkeypatch):
    """Return a function that trains in two such tasks; it returns the exit code, the reason and the tasks."""
    word = tmp_path / "word"
    monkeypatch.setenv("PALAESTRA_TERMINATION_LOG", str(word))

    def run(amid=None, at_close=lambda: None, callbacks=()):
        tasks = []

        def make_members(given):
            members = [make_member(entry.name) for entry in given.simulators]
            for member in members:
                member.env = Task(amid if not tasks else None, at_close)
                tasks.append(member.env)
            return members

        configuration = make_configuration(
            algorithm={
                "name": "PPO",
                "hyperparameters": {"n_steps": 8, "batch_size": 8, "policy_kwargs": {"net_arch": [4]}},
                "callbacks": [{"name": f"{__name__}:{each.__name__}"} for each in callbacks],
            },
            collectors=2,
            steps=32,
            evaluation={"everySteps": 0},
        )
        code = attempt.run(configuration, RunDirectory(tmp_path / "run"), make_members)
        return code, json.loads(word.read_text())["reason"], tasks

    return run


@pytest.mark.parametrize("at_close", [fails, leaves])
@pytest.mark.parametrize(
    ("amid", "code", "reason"),
    [
        (None, 0, "Completed: "),
        (is_asked_to_end, 75, "Interrupted: SIGTERM"),
        (diverges, 81, "Diverged: "),
        (breaks, 1, "Unexpected: RuntimeError: my first cause"),
    ],
)
def test_an_environment_that_fails_to_close_changes_no_end(play, amid, at_close, code, reason):
    """The end was decided before `close`, and the other environments must still be closed."""
    found, word, tasks = play(amid, at_close)

    assert found == code
    assert word.startswith(reason)
    assert [task.closed for task in tasks[:2]] == [True, True]


def test_an_environment_cannot_end_the_program_as_if_the_run_were_complete(play):
    """A library that exits with code 0 would mark a run without a model as complete."""
    code, word, _ = play(leaves)

    assert code == 1
    assert word.startswith("ProgramEnded: ")
    assert f"SystemExit: 0, in {__file__} line" in word


def test_a_callback_cannot_end_the_program_as_if_the_run_were_complete(play):
    """A callback ends a training by returning False, or by raising an error."""
    code, word, _ = play(callbacks=[Leaves])

    assert code == 1
    assert word.startswith("CallbackFailed: ")
    assert "SystemExit: 0" in word


def test_an_environment_that_hangs_when_it_is_closed_does_not_keep_the_run():
    """The exit code that was decided before `close` is used."""
    left = []

    leave_after(0.05, 75, lambda: left.append("word"), left.append).join(20)

    assert left == ["word", 75]


def test_nobody_watches_for_steps_while_everything_is_stopped(play):
    """A `close` may take longer than `stallDeadlineSeconds`, and must not end a complete run as stalled."""
    watching = []

    def close():
        for thread in [each for each in threading.enumerate() if each.name == "watchdog"]:
            thread.join(20)  # a watchdog that was stopped ends at once
            watching.append(thread.is_alive())

    code, _, _ = play(at_close=close)

    assert code == 0
    assert not any(watching)


LIVES_ON = """
import sys, threading, time
from importlib import import_module
from palaestra_trainer.cli import program
from palaestra_trainer.run.telemetry.logs import configure_logs
configure_logs()
name = sys.argv[1]
module = import_module("palaestra_trainer.cli." + name)
setattr(module, name, lambda: 75)
program.LEFT_S = 1.0
threading.Thread(target=time.sleep, args=(300,), name="mine").start()
code = getattr(module, name + "_and_leave")()
print("ended", flush=True)
sys.exit(code)
"""


@pytest.mark.parametrize("name", ["train", "evaluate", "export"])
def test_a_thread_that_lives_on_does_not_keep_the_program(name):
    """The program ends soon with its own exit code, and the log has the name of the thread.

    Signals that arrive meanwhile do not change the exit code.
    """
    with subprocess.Popen(
        [sys.executable, "-c", LIVES_ON, name], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as program:
        assert program.stdout.readline() == "ended\n"
        if name == "train":
            program.send_signal(signal.SIGTERM)
        began = time.monotonic()
        said = program.stderr.read()

    assert program.returncode == 75
    assert "mine" in said
    assert time.monotonic() - began < 60
