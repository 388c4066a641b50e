"""A run that is interrupted and resumed equals an uninterrupted run, bit by bit, with fake simulators."""

from __future__ import annotations

import itertools
import json
import os
import random
import signal
import zipfile

import numpy as np
import pytest
import torch
from stable_baselines3.common.save_util import load_from_zip_file
from torch.optim.optimizer import register_optimizer_step_pre_hook

from palaestra_trainer.errors import MasterLost
from palaestra_trainer.job.configuration import load
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run import attempt as run_attempt
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.telemetry.logs import configure_logs
from palaestra_trainer.run.telemetry.progress import Progress
from palaestra_trainer.waiting import shutdown_deadline

SMALL = {"policy_kwargs": {"net_arch": [16]}}
OFF_POLICY = SMALL | {"learning_starts": 50, "batch_size": 16, "buffer_size": 300}
ON_POLICY = SMALL | {"learning_rate": "lin_1e-3"}
ALGORITHMS = {
    # The target network changes during a rollout, and epsilon and the learning rate change with progress.
    "DQN": OFF_POLICY | {"exploration_fraction": 0.7},
    "PPO": ON_POLICY | {"n_steps": 64, "batch_size": 16, "n_epochs": 2},
    "A2C": ON_POLICY,
    # SAC has a second optimizer, for its entropy coefficient.
    "SAC": OFF_POLICY,
    "REINFORCE": ON_POLICY | {"episodes_per_update": 2},
}


def terminate():
    """Interrupt the run with SIGTERM."""
    os.kill(os.getpid(), signal.SIGTERM)


def lose_the_master():
    """End the run during a rollout; it then saves its last complete state."""
    raise MasterLost("gone")


def kill():
    """End the run without a checkpoint."""
    raise ZeroDivisionError("as good as a kill")


INTERRUPTIONS = {terminate: 75, lose_the_master: 75, kill: 1}


class Listening(Progress):
    """A progress display that records step, return and length of each episode."""

    def __init__(self, configuration):
        super().__init__(configuration.steps, [(it.name, it.role) for it in configuration.simulators])
        self.ended = []

    def collected(self, step, infos):
        """Record the episodes that ended in this step."""
        super().collected(step, infos)
        self.ended += [(step, *(info["episode"][key] for key in "rl")) for info in infos if "episode" in info]


@pytest.fixture
def attempt(fakes):
    """Return a function that runs one attempt and returns its exit code.

    The function calls `interrupt` at one step of the first robot. It appends the attempt's episodes to
    `episodes`, after it has removed the episodes that followed the checkpoint from which the attempt starts.
    """
    configure_logs()

    def play(job, directory, episodes, at=0, interrupt=None):
        configuration = load(job)
        progress = Listening(configuration)
        saved = checkpoint.newest(directory.checkpoints)
        episodes[:] = [it for it in episodes if saved and it[0] <= saved.manifest.step]

        def make_members(given):
            members = fakes.make_members(given)
            fakes.before_step(members[0].robot, at, interrupt)
            return members

        around = run_attempt.AttemptDependencies(make_members=make_members, environment={})
        end = run_attempt.Attempt(configuration, directory, progress, around).play()
        episodes += progress.ended
        return end.code

    return play


def tensors(path):
    """Return all tensors of a model and its optimizers by name, and the statistics of its normalization."""
    _, parameters, variables = load_from_zip_file(path, device="cpu", load_data=False)

    def walk(name, value):
        if isinstance(value, dict):
            for key in value:
                yield from walk(f"{name}.{key}", value[key])
        elif isinstance(value, torch.Tensor):
            yield name, value.tolist()

    with zipfile.ZipFile(path) as archive:
        normalized = [it for it in archive.namelist() if it == "normalize.json"]
        known = {name: json.loads(archive.read(name)) for name in normalized}
    return dict(walk("", parameters | (variables or {}))) | known


def outcome(directory):
    """Return, by name, the evaluations of a run and all data that its next step would use."""
    found = checkpoint.newest(directory.checkpoints)
    state = json.loads((found.path / "state.json").read_text())
    for episode in state["episodes"]:
        del episode["t"]  # the wall time of the episode, which differs in every run
    with np.load(found.path / "state.npz") as arrays:
        state |= {name: array.tolist() for name, array in arrays.items()}
    experience = {name: digest for name, digest in found.manifest.files.items() if "experience" in name}
    lines = {"evaluations": directory.evaluations.read_text()}
    return tensors(found.path / "model.zip") | state | experience | lines


def differences(one, other):
    """Return the names of the results in which two runs differ."""
    this, that = outcome(one), outcome(other)
    return [name for name in this.keys() | that.keys() if this.get(name) != that.get(name)]


@pytest.fixture
def job(write_job):
    """Return a function that writes the job of a short run with an algorithm."""

    def write(name, collectors=1, actions="discrete", normalize=None, **hyperparameters):
        options = {"max_steps": 30, "actions": "continuous" if name == "SAC" else actions}
        algorithm = {"name": name, "hyperparameters": ALGORITHMS[name] | hyperparameters}
        return write_job(
            collectors=collectors,
            algorithm=algorithm | ({} if normalize is None else {"normalize": normalize}),
            environment={"id": "MoveToTargetEnv-v0", "options": options},
            steps=400,
            evaluation={"everySteps": 200, "episodes": 1, "confirmEpisodes": 1},
            checkpoint={"everySteps": 100, "keep": 2},
        )

    return write


@pytest.mark.parametrize("collectors", [1, 2])
@pytest.mark.parametrize("name", ALGORITHMS)
def test_an_interrupted_run_is_the_run_that_was_not(attempt, job, tmp_path, name, collectors):
    """A signal, the loss of the ROS master and a kill interrupt the run at random steps.

    Returns, evaluations, parameters, optimizers, experience and random generators must be equal to the last
    bit.
    """
    whole, parts = RunDirectory(tmp_path / "whole"), RunDirectory(tmp_path / "parts")
    points = random.Random(f"{name} {collectors}")
    ended, played = [], []

    assert attempt(job(name, collectors), whole, ended) == 0
    for interrupt, expected in INTERRUPTIONS.items():
        point = points.randint(30, 150 // collectors)
        assert attempt(job(name, collectors), parts, played, point, interrupt) == expected
    assert attempt(job(name, collectors), parts, played) == 0

    assert played == ended
    assert differences(whole, parts) == []


@pytest.mark.parametrize(
    ("name", "collectors", "normalize"),
    [
        ("DQN", 2, {}),
        ("PPO", 2, {"clipObservations": 2}),
        ("A2C", 1, {"observations": False}),
        ("SAC", 1, {"rewards": False}),
        ("REINFORCE", 2, {}),
    ],
)
def test_what_a_run_normalizes_by_goes_on_where_it_was(attempt, job, tmp_path, name, collectors, normalize):
    """The statistics change at every step, even during a rollout that is repeated after a resume."""
    whole, parts = RunDirectory(tmp_path / "whole"), RunDirectory(tmp_path / "parts")
    normalizing = job(name, collectors, normalize=normalize)
    ended, played = [], []

    assert attempt(normalizing, whole, ended) == 0
    for point, interrupt in zip((77, 60, 31), INTERRUPTIONS, strict=True):
        assert attempt(normalizing, parts, played, point, interrupt) == INTERRUPTIONS[interrupt]
    assert attempt(normalizing, parts, played) == 0

    assert "normalize.json" in outcome(whole)
    assert played == ended
    assert differences(whole, parts) == []


@pytest.mark.parametrize("name", ALGORITHMS)
def test_an_update_that_takes_too_long_is_left_in_its_middle(attempt, job, tmp_path, name):
    """The end of the pod must not wait minutes for an update, so the update is aborted and undone.

    The signal arrives in the second of many gradient steps, and no further gradient step follows.
    """
    whole, parts = RunDirectory(tmp_path / "whole"), RunDirectory(tmp_path / "parts")
    asked_at = 1 if name in {"A2C", "REINFORCE"} else 2
    ended, played, steps = [], [], itertools.count(1)

    def ask(*_step):
        if next(steps) == asked_at:
            terminate()
            shutdown_deadline.end(0.0)

    assert attempt(job(name), whole, ended) == 0
    assert attempt(job(name), parts, played, 130, kill) == 1
    with register_optimizer_step_pre_hook(ask):
        assert attempt(job(name), parts, played) == 75
    assert attempt(job(name), parts, played) == 0

    assert next(steps) == asked_at + 1
    assert played == ended
    assert differences(whole, parts) == []


@pytest.mark.parametrize("name", ["DQN", "SAC"])
def test_the_first_update_of_a_run_may_be_left_too(attempt, job, tmp_path, name):
    """An off-policy run has no measured time for its first update, and must not wait for it either."""
    whole, parts = RunDirectory(tmp_path / "whole"), RunDirectory(tmp_path / "parts")
    thorough = job(name, gradient_steps=4)
    ended, played, steps = [], [], itertools.count(1)

    def ask(*_step):
        if next(steps) == 1:
            terminate()
            shutdown_deadline.end(0.0)

    assert attempt(thorough, whole, ended) == 0
    with register_optimizer_step_pre_hook(ask):
        assert attempt(thorough, parts, played) == 75
    assert attempt(thorough, parts, played) == 0

    assert next(steps) == 2
    assert played == ended
    assert differences(whole, parts) == []


@pytest.mark.parametrize("name", ["PPO", "SAC"])
def test_state_dependent_exploration_goes_on_with_its_noise(attempt, job, tmp_path, name):
    """The noise is drawn once at the start of a rollout, so a resumed rollout needs the same noise."""
    whole, parts = RunDirectory(tmp_path / "whole"), RunDirectory(tmp_path / "parts")
    noisy = job(name, actions="continuous", use_sde=True, sde_sample_freq=7)

    assert attempt(noisy, whole, []) == 0
    assert attempt(noisy, parts, [], 77, lose_the_master) == 75
    assert attempt(noisy, parts, []) == 0

    assert differences(whole, parts) == []
