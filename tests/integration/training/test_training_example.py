"""The script `examples/own_training_script.py` with fake simulators."""

from __future__ import annotations

import os
import runpy
import signal
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from stable_baselines3 import PPO

from palaestra_trainer.run.fault_tolerant import make

SCRIPT = Path(__file__).parents[3] / "examples" / "own_training_script.py"


class Hall(gymnasium.Env):
    """An environment that accepts only robot and scene, and neither role nor reward."""

    observation_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
    action_space = spaces.Discrete(2)

    def __init__(self, robot, scene):
        self._world = robot, scene
        self._steps = 0

    def reset(self, *, seed=None, options=None):
        """Reset the step count, and return an observation of zeros."""
        del options
        super().reset(seed=seed)
        self._steps = 0
        return np.zeros(2, np.float32), {}

    def step(self, action):
        """Take a step; the episode ends after five."""
        del action
        self._steps += 1
        return np.zeros(2, np.float32), 1.0, self._steps == 5, False, {}


@pytest.fixture
def hall():
    """Register the environment and yield its id."""
    gymnasium.register(id="Hall-v0", entry_point=Hall)
    yield "Hall-v0"
    gymnasium.registry.pop("Hall-v0")


@pytest.fixture
def script(write_job, fakes, tmp_path, monkeypatch):
    """Yield a function that runs the script with two collecting simulators and one for evaluation.

    The function returns the names of the simulators that the script started.
    """
    before = signal.getsignal(signal.SIGTERM)
    (tmp_path / "run").mkdir()
    monkeypatch.setenv("PALAESTRA_RUN", str(tmp_path / "run"))

    def run(attempt, on_start=lambda: None, **changes):
        started = []
        monkeypatch.setenv("PALAESTRA_CONFIG", str(write_job(collectors=2, steps=100, **changes)))

        def made(configuration):
            members = fakes.make_members(configuration)
            for member in members:
                member.start = lambda name=member.name: (started.append(name), on_start())
            return members

        (tmp_path / attempt).mkdir()
        monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / attempt))
        monkeypatch.setattr(make, "connect_members", made)
        runpy.run_path(str(SCRIPT), run_name="__main__")
        return started

    yield run
    signal.signal(signal.SIGTERM, before)


def test_a_script_of_one_s_own_trains_in_the_configured_simulators(script, tmp_path, capsys):
    """The script needs only gymnasium, Stable-Baselines3 and two environment variables."""
    started = script("first")

    assert PPO.load(tmp_path / "run" / "model.zip").num_timesteps == 1024
    assert "mean return" in capsys.readouterr().out
    assert sorted(started) == ["collect-0", "collect-1", "evaluate-0"]


def test_a_script_of_one_s_own_trains_in_an_environment_without_reward_and_role(script, hall, capsys):
    """Users copy the script, so it must accept every environment that the built-in loop accepts."""
    script("first", environment={"id": hall})

    assert "mean return 5.00 over 4 episodes" in capsys.readouterr().out


def test_a_script_that_is_interrupted_goes_on_from_its_model(script, tmp_path, capsys):
    """Exit code 75 requests a restart, and the script must then not begin at step 0."""
    with pytest.raises(SystemExit) as ended:
        script("first", on_start=lambda: os.kill(os.getpid(), signal.SIGTERM))
    first = PPO.load(tmp_path / "run" / "model.zip").num_timesteps

    script("second")

    assert ended.value.code == 75
    assert 0 < first < 1024
    assert PPO.load(tmp_path / "run" / "model.zip").num_timesteps == first + 1024
    assert "mean return" in capsys.readouterr().out
