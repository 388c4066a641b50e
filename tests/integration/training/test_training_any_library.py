"""Training loops of other libraries complete all steps with stubs that crash, and get only valid rows."""

from __future__ import annotations

import runpy
import signal
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3 import DQN
from stable_baselines3.common.env_checker import check_env as check_env_for_sb3
from stable_baselines3.common.vec_env import VecCheckNan

import palaestra_trainer
from palaestra_trainer.errors import ConfigurationError
from tests.local_run import below, left_of

EXAMPLES = Path(__file__).parents[3] / "examples"
TASK = "MoveToTargetEnv-v0"
PATIENCE_S = 120.0
LOOP = f"""
from palaestra_trainer import make_vec_env
envs = make_vec_env("{TASK}", 2)
envs.reset(seed=1)
print("steps", flush=True)
while True:
    envs.step(envs.action_space.sample())
"""


@pytest.fixture
def stubs(master, monkeypatch):
    """Return a function that sets the faults of the stubs that a notebook starts.

    The seed is fixed, so the faults are the same in each run.
    """
    del master
    monkeypatch.delenv("PALAESTRA_CONFIG", raising=False)
    monkeypatch.setenv("PALAESTRA_STUB_FAULT_SEED", "1")
    return lambda faults: monkeypatch.setenv("PALAESTRA_STUB_FAULTS", faults)


class Checked(gymnasium.vector.VectorWrapper):
    """A vector environment that checks all rows, and counts steps and episodes ended by a fault."""

    def __init__(self, env):
        super().__init__(env)
        self.steps = self.cut = 0

    def step(self, actions):
        """Take a step and check the result."""
        result = super().step(actions)
        observations, rewards, _, truncations, infos = result
        faults = (
            infos.get("final_info", {}).get("palaestra", {}).get("_sim_fault", np.zeros(self.num_envs, bool))
        )
        assert observations in self.observation_space
        assert np.isfinite(rewards).all()
        assert truncations[faults].all()
        assert (rewards[faults] == 0).all()
        self.steps += self.num_envs
        self.cut += faults.sum()
        return result


@pytest.mark.parametrize("script", ["ppo_in_one_file.py", "skrl_ppo.py"])
def test_a_loop_of_another_library_survives_crashes(stubs, script, monkeypatch, tmp_path, capsys):
    """An author's loop knows only the interface of environments, and must not need a change."""
    stubs("crash:probability=0.02")
    make, made = palaestra_trainer.make_vec_env, []
    monkeypatch.setattr(
        palaestra_trainer, "make_vec_env", lambda *given: made.append(Checked(make(*given))) or made[-1]
    )
    monkeypatch.chdir(tmp_path)
    options = ["--environment", TASK, "--simulators", "2", "--steps", "192", "--rollout", "32"]
    monkeypatch.setattr(sys, "argv", [script, *options])

    runpy.run_path(str(EXAMPLES / script), run_name="__main__")

    assert made[0].steps == 192
    assert made[0].cut >= 2
    assert "done: 192 steps" in capsys.readouterr().out


def test_stable_baselines3_survives_crashes(stubs):
    """The wrapper `VecCheckNan` raises an error for any NaN, so the rows of a fault must contain numbers."""
    stubs("crash:probability=0.02")
    env = palaestra_trainer.make_sb3_vec_env(TASK, 2, max_steps=30)
    try:
        model = DQN("MlpPolicy", VecCheckNan(env, raise_exception=True), learning_starts=50, seed=1).learn(
            200
        )
    finally:
        env.close()

    assert model.num_timesteps == 200


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version")
def test_the_checkers_accept_an_environment_of_one_simulator(stubs):
    """Users run the checkers of gymnasium and Stable-Baselines3 on their environments."""
    stubs("")
    env = palaestra_trainer.make_env(TASK)
    try:
        check_env(env, skip_render_check=True)
        check_env_for_sb3(env, skip_render_check=True)
    finally:
        env.close()


@pytest.mark.usefixtures("stubs")
def test_an_environment_without_a_name_needs_a_job():
    """In a notebook, no job names the environment, so the error must say what to pass."""
    with pytest.raises(
        ConfigurationError, match="environment: none was given, and PALAESTRA_CONFIG is not set"
    ):
        palaestra_trainer.make_env()
    with pytest.raises(ConfigurationError, match=r"its options were given \(max_steps\)"):
        palaestra_trainer.make_vec_env(max_steps=3)
    with pytest.raises(ConfigurationError, match="num_envs: 0 is not a number"):
        palaestra_trainer.make_vec_env(TASK, 0)


def test_the_simulators_of_a_job_are_used_and_released(simulators):
    """An environment uses all collecting simulators, and leaves the evaluating one to another environment.

    After `close`, another environment can use the simulators.
    """
    envs = palaestra_trainer.make_vec_env()
    envs.reset(seed=1)
    running = [name for name, launcher in simulators.items() if launcher.ready()]
    with pytest.raises(ConfigurationError, match="each has an environment"):
        palaestra_trainer.make_env()
    envs.close()
    stopped = [name for name, launcher in simulators.items() if launcher.ready()]
    with palaestra_trainer.make_env(role="Evaluate") as env:
        env.reset()

    assert (envs.num_envs, running, stopped) == (2, ["collect-0", "collect-1"], [])


def test_ctrl_c_ends_everything_that_was_started(stubs):
    """A simulator that stays would keep a processor busy."""
    stubs("")
    with subprocess.Popen(
        [sys.executable, "-c", LOOP], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as program:
        assert "steps\n" in iter(program.stdout.readline, "")  # on a busy machine, log lines come first
        started = [pid for pid, _ in below(program.pid) if pid != program.pid]
        program.send_signal(signal.SIGINT)
        _, said = program.communicate(timeout=PATIENCE_S)

    assert program.returncode == -signal.SIGINT
    assert said.rstrip().endswith("KeyboardInterrupt")
    assert len(started) >= 2
    assert left_of(started) == []
