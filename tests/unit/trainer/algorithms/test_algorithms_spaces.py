"""Spaces that Stable-Baselines3 would handle wrongly are rejected before a simulator starts.

Stable-Baselines3's own checker rejects them too, or they would cause a traceback. Spaces that work are
tested in the grid of algorithms.
"""

from __future__ import annotations

import re

import numpy as np
import pytest
from gymnasium import spaces

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run import attempt as run_attempt
from palaestra_trainer.run.fault_tolerant.env_group import EnvGroup
from palaestra_trainer.run.fault_tolerant.sb3_vec_env import FaultTolerantVecEnv
from palaestra_trainer.run.telemetry.progress import Progress
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.testing import FakeTask

NUMBERS = spaces.Box(-1.0, 1.0, (2,), np.float32)
FEW = spaces.Discrete(3)
OBSERVATIONS = {
    "counts from 1": (spaces.Discrete(5, start=1), "observation counts from 1, and networks count from 0"),
    "counts from 2 in a Dict": (
        spaces.Dict({"floor": spaces.MultiDiscrete([3, 3], start=[0, 2])}),
        r"observation floor counts from \[0, 2\]",
    ),
    "a matrix of bits": (spaces.MultiBinary((2, 3)), r"MultiBinary of shape \(2, 3\); flatten it"),
    "a single number": (spaces.Box(-1.0, 1.0, (), np.float32), r"shape \(\); give it the shape \(1,\)"),
    "a Dict in a Dict": (
        spaces.Dict({"a": spaces.Dict({"b": NUMBERS})}),
        "observation a is a Dict, which no",
    ),
    "a Dict without parts": (spaces.Dict({}), "a Dict without parts"),
    "text": (spaces.Text(5), "is a Text, which no policy accepts"),
}
ACTIONS = {
    "counts from -1": (spaces.Discrete(3, start=-1), "action counts from -1, and networks count from 0"),
    "counts from 1 and 2": (spaces.MultiDiscrete([3, 3], start=[1, 2]), r"action counts from \[1, 2\]"),
    "a matrix of bits": (spaces.MultiBinary((2, 3)), "flatten it"),
    "a single number": (spaces.Box(-1.0, 1.0, (), np.float32), r"give it the shape \(1,\)"),
    "whole numbers": (
        spaces.Box(-5, 5, (2,), np.int32),
        "a Box of int32, but algorithms send fractional values",
    ),
    "as wide as floats": (
        spaces.Box(np.finfo(np.float32).min, np.finfo(np.float32).max, (2,), np.float32),
        "has bounds whose difference is too large for float32; give narrower bounds",
    ),
    "no bounds": (spaces.Box(-np.inf, np.inf, (2,), np.float32), "has no bounds; give its Box a finite low"),
}
CASES = {f"observation: {name}": (seen, FEW, told) for name, (seen, told) in OBSERVATIONS.items()} | {
    f"action: {name}": (NUMBERS, acted, told) for name, (acted, told) in ACTIONS.items()
}


@pytest.fixture
def members(make_member):
    """Return a function that makes simulators of a task with these spaces.

    Their logs show whether they were started.
    """

    def make(names, seen, acted):
        made = [make_member(name) for name in names]
        for member in made:
            member.env = FakeTask(seen, acted)
        return made

    return make


@pytest.fixture
def play(members, make_configuration, tmp_path):
    """Return a function that runs an attempt in such a task.

    It returns the attempt's end and the simulators.
    """

    def run(seen, acted):
        configuration = make_configuration(algorithm={"name": "PPO", "hyperparameters": {"n_steps": 16}})
        made = []

        def make_members(given):
            made.extend(members([entry.name for entry in given.simulators], seen, acted))
            return made

        simulators = [(entry.name, entry.role) for entry in configuration.simulators]
        around = run_attempt.AttemptDependencies(make_members=make_members, environment={})
        attempt = run_attempt.Attempt(
            configuration, RunDirectory(tmp_path / "run"), Progress(configuration.steps, simulators), around
        )
        return attempt.play(), made

    return run


@pytest.mark.parametrize(("seen", "acted", "told"), CASES.values(), ids=CASES)
def test_a_run_refuses_it_before_a_simulator_starts(play, seen, acted, told):
    """A person waits only seconds for the error, which names the space and the remedy."""
    end, members = play(seen, acted)

    assert end.code == 2
    assert re.search(told, end.message)
    assert [member.log for member in members] == [["stop"]] * len(members)


@pytest.mark.parametrize(("seen", "acted", "told"), CASES.values(), ids=CASES)
def test_a_vector_for_a_loop_of_one_s_own_refuses_it_too(members, seen, acted, told):
    """Stable-Baselines3 would send actions that are outside the space."""
    [member] = members(["collect-0"], seen, acted)

    with pytest.raises(ConfigurationError, match=told):
        FaultTolerantVecEnv(EnvGroup([Restarter(member)], lambda: None))
