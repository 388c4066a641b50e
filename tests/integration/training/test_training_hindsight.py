"""Runs with hindsight experience replay, on fake simulators."""

from __future__ import annotations

import json
import os
import signal

import numpy as np
import pytest

from palaestra_trainer import load_policy
from palaestra_trainer.job.configuration import load
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run import attempt as run_attempt
from palaestra_trainer.run import checkpoint

GOALS = {"id": "MoveToTargetGoalEnv-v0", "reward": "Sparse", "options": {"max_steps": 30}}
HINDSIGHT = {
    "policy_kwargs": {"net_arch": [16]},
    "learning_starts": 50,
    "batch_size": 16,
    "buffer_size": 300,
    "replay_buffer_class": "HerReplayBuffer",
    "replay_buffer_kwargs": {"n_sampled_goal": 4, "goal_selection_strategy": "future"},
}


@pytest.fixture
def job(write_job):
    """Return a function that writes a job with hindsight experience replay."""

    def write(name="DQN", environment=GOALS, **changes):
        actions = {"actions": "continuous"} if name == "SAC" else {}
        task = environment | {"options": environment["options"] | actions}
        settings = {"collectors": 2, "steps": 500, "algorithm": {"name": name, "hyperparameters": HINDSIGHT}}
        return write_job(environment=task, **settings | changes)

    return write


@pytest.fixture
def attempt(fakes, tmp_path):
    """Return a function that runs one attempt in a folder.

    At step `at` of the first robot, this process gets SIGTERM.
    """

    def play(job, folder, at=0, deaths=(90, 150)):
        def make_members(given):
            members = fakes.make_members(given, deaths)
            fakes.before_step(members[0].robot, at, lambda: os.kill(os.getpid(), signal.SIGTERM))
            return members

        directory = RunDirectory(tmp_path / folder)
        return run_attempt.run(load(job), directory, make_members), directory

    return play


def digests(directory):
    """Return the step of the newest checkpoint, and the digests of its replay buffer."""
    newest = checkpoint.newest(directory.checkpoints)
    files = newest.manifest.files
    return newest.manifest.step, {name: files[name] for name in files if name.startswith("experience")}


@pytest.mark.parametrize(("name", "more"), [("DQN", {}), ("SAC", {}), ("DQN", {"normalize": {}})])
def test_a_run_with_hindsight_survives_faults_and_ends(job, attempt, name, more):
    """One of two simulators dies twice; the run must still complete, and its policy must be loadable."""
    algorithm = {"name": name, "hyperparameters": HINDSIGHT} | more
    code, directory = attempt(job(name, algorithm=algorithm), "run")

    summary = json.loads(directory.summary.read_text())
    policy = load_policy(directory.path)
    seen = {"observation": np.zeros(18, np.float32)} | dict.fromkeys(
        ("achieved_goal", "desired_goal"), np.zeros(2, np.float32)
    )
    assert code == 0
    # Two simulators take two steps at once; while one of them restarts, only one step is counted.
    assert (summary["faults"], summary["steps"]) in {(2, 500), (2, 501)}
    assert policy.predict(seen)[0].shape == (() if name == "DQN" else (3,))


@pytest.mark.parametrize("at", [20, 77, 120, 201])
def test_an_interrupted_run_ends_as_one_that_was_not(job, attempt, at):
    """The signal arrives before the end of the first episode, during episodes, or after the buffer is full.

    In each case, the results must equal those of an uninterrupted run, bit by bit.
    """
    written = job(steps=600, evaluation={"everySteps": 300, "episodes": 2, "confirmEpisodes": 0})

    _, whole = attempt(written, "whole", deaths=())
    first, parts = attempt(written, "parts", at=at, deaths=())
    second, _ = attempt(written, "parts", deaths=())

    assert (first, second) == (75, 0)
    assert digests(parts) == digests(whole)
    assert parts.evaluations.read_text() == whole.evaluations.read_text()


def test_a_task_without_goals_is_refused(job, play):
    """The author must get the error before a simulator starts."""
    plain = {"id": "MoveToTargetEnv-v0", "options": {}}

    code, log = play(job(environment=plain))

    assert code == 2
    assert "environment.id: MoveToTargetEnv-v0 has no compute_reward" in log
