"""Runs in an environment of the job's author, with fake simulators."""

from __future__ import annotations

import textwrap
from pathlib import Path

import gymnasium
import pytest

from tests.pages import blocks

PAGE = Path(__file__).parents[3] / "docs/howto/use-a-policy.md"

HALL = """
    import gymnasium
    import numpy as np


    class Hall(gymnasium.Env):
        observation_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)
        action_space = gymnasium.spaces.Discrete(2)
        SEEN = np.zeros(2, np.float32)

        def __init__(self, {arguments}):
            self.steps = 0

        def reset(self, *, seed=None, options=None):
            super().reset(seed=seed)
            self.steps = 0
            return {seen}, {{}}

        def step(self, action):
            self.steps += 1
            return {seen}, 1.0, self.steps == 5, False, {{"is_success": True}}


    gymnasium.register(id="Hall-v0", entry_point=Hall)
"""
PPO = {"name": "PPO", "hyperparameters": {"n_steps": 64, "batch_size": 32, "n_epochs": 2}}


@pytest.fixture
def train(write_job, play, tmp_path, monkeypatch):
    """Yield a function that writes an environment, trains in it, and returns exit code and log."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def run(arguments="robot, scene", seen="self.SEEN", number=0, **changes):
        module = f"hall_{tmp_path.name}_{number}".replace("-", "_")
        (tmp_path / f"{module}.py").write_text(textwrap.dedent(HALL).format(arguments=arguments, seen=seen))
        environment = {"id": f"{module}:Hall-v0"}
        return play(write_job(**{"environment": environment, "steps": 64, "algorithm": PPO} | changes))

    yield run
    gymnasium.registry.pop("Hall-v0", None)


def test_an_own_environment_without_reward_trains(train):
    """The included environments accept `reward`, but an author's environment need not."""
    code, log = train()

    assert code == 0, log


@pytest.mark.parametrize(
    ("arguments", "seen", "fact"),
    [
        ("size=1", "self.SEEN", "accepts neither robot nor scene"),
        ("robot, scene", "np.zeros(3, np.float32)", "shape (3,), not (2,)"),
        ("robot, scene", "np.zeros(2)", "dtype float64, not float32"),
        ("robot, scene", "self.SEEN + 2", "2.0 at [0], not between -1.0 and 1.0"),
    ],
    ids=["signature", "shape", "dtype", "range"],
)
def test_a_wrong_environment_ends_the_run_with_2(train, arguments, seen, fact):
    """A retry cannot help, and the author reads one line instead of tracebacks."""
    code, log = train(arguments, seen)

    assert code == 2, log
    assert fact in log
    assert "ConfigurationWrong" in log
    assert "Traceback" not in log


def test_nan_from_an_own_environment_names_it_and_ends_the_run_with_81(train):
    """The simulator works, so its restart would not help. The author must see which value is NaN."""
    code, log = train(seen="np.array([0.0, np.nan], np.float32)")

    assert code == 81, log
    assert "episode 0, reset: collect-0: environment Hall-v0: observation[1] is nan" in log
    assert "simulator fault" not in log


@pytest.mark.parametrize(
    ("arguments", "name"), [("robot, scene", "PPO"), ("robot", "PPO"), ("scene, size=1", "RecurrentPPO")]
)
def test_its_policy_is_used_as_the_page_shows(train, tmp_path, arguments, name):
    """The page's code must work for environments without the argument `simulator`, and without a scene."""
    [block] = [text for text in blocks(PAGE.read_text(), "python") if "def drive(" in text]
    code, log = train(arguments, algorithm=PPO | {"name": name})
    typed = {}
    exec(block, typed)

    total = typed["drive"](tmp_path / "run")

    assert code == 0, log
    assert total == 5.0
