"""Vector environments of gymnasium and Stable-Baselines3 use a job's simulators, which are real stubs."""

from __future__ import annotations

import os
from functools import partial

import gymnasium
import numpy as np
import pytest
from stable_baselines3.common.vec_env import SubprocVecEnv

import palaestra_trainer.environments  # noqa: F401 - registers the environment

TASK = "palaestra_trainer.environments:MoveToTargetEnv-v0"


def running(simulators):
    """Return the names of the simulators that are ready."""
    return [name for name, launcher in simulators.items() if launcher.ready()]


@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_each_worker_of_gymnasium_drives_a_simulator_of_its_own(simulators, method):
    """Two workers in one simulator would move each other's robot, without an error."""
    envs = gymnasium.make_vec(TASK, num_envs=2, vectorization_mode="async", vector_kwargs={"context": method})
    try:
        assert_apart(envs)
        assert running(simulators) == ["collect-0", "collect-1"]
    finally:
        envs.close()


def assert_apart(envs):
    """Assert that, if one robot drives and the other stands, each environment sees only its own robot."""
    _, infos = envs.reset(seed=[1, 2])
    assert infos["start"].shape[0] == 2
    distances = []
    for _ in range(4):
        observations, *_ = envs.step(np.array([1, 0]))
        distances.append(np.asarray(observations)[:, 10:13])  # the robot's velocity in the observation
    moving, standing = np.abs(np.asarray(distances)).sum(axis=(0, 2))
    assert moving > 1.0
    assert standing < 0.1


def test_each_worker_of_stable_baselines3_drives_a_simulator_of_its_own(simulators):
    """SubprocVecEnv starts its workers from a fork server, which inherits no simulator."""
    ours = {name: value for name, value in os.environ.items() if name.startswith(("PALAESTRA_", "ROS_"))}
    make = partial(make_environment, ours)
    envs = SubprocVecEnv([make] * 2, start_method="forkserver")
    try:
        envs.seed(1)
        envs.reset()
        seen = [envs.step(np.array([1, 0]))[0][:, 10:13] for _ in range(4)]
        moving, standing = np.abs(np.asarray(seen)).sum(axis=(0, 2))
        assert moving > 1.0
        assert standing < 0.1
        assert running(simulators) == ["collect-0", "collect-1"]
    finally:
        envs.close()


def make_environment(variables):
    """Return the environment of the job.

    The fork server has the variables of an earlier test, so they are set again.
    """
    os.environ.update(variables)
    return gymnasium.make(TASK)
