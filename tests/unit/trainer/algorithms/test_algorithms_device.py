"""The device of the networks: the CPU, or a GPU if the job requests one."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from structlog.testing import capture_logs

from palaestra_trainer.algorithms import make_model
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.checkpoint.rng import Generators
from palaestra_trainer.run.evaluate import measure
from palaestra_trainer.simulators.restarter import Restarter

TINY = {"policy_kwargs": {"net_arch": [8]}}
OFF_POLICY = TINY | {"learning_starts": 10, "batch_size": 8, "buffer_size": 200}
ALGORITHMS = {
    "DQN": OFF_POLICY,
    # With `use_sde`, SAC draws exploration noise on the device before each rollout.
    "SAC": OFF_POLICY | {"use_sde": True},
    "PPO": TINY | {"n_steps": 16, "batch_size": 8},
    "A2C": TINY,
    "REINFORCE": TINY | {"episodes_per_update": 2},
}
GPU = pytest.mark.skipif(not torch.cuda.is_available(), reason="PyTorch sees no GPU here")


@pytest.fixture
def no_gpu(monkeypatch):
    """Hide every GPU from PyTorch."""
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)


@pytest.fixture
def make(make_member, make_configuration):
    """Return a function that makes a small model on a device, with its environment and configuration."""

    def made(name, device):
        member = make_member()
        if name == "SAC":
            member.env.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
        algorithm = {"name": name, "hyperparameters": ALGORITHMS[name]}
        configuration = make_configuration(algorithm=algorithm, device=device)
        env = SimulatorsVecEnv([Restarter(member)], run_seed=1)
        return make_model(configuration.algorithm, env, 1, configuration.device), env, configuration

    return made


def missing_gpus(logs):
    """Return the log lines about a missing GPU."""
    return [line for line in logs if "GPU" in line["event"]]


@pytest.mark.usefixtures("no_gpu")
def test_where_there_is_no_gpu_a_job_that_asks_for_one_trains_on_the_cpu_and_says_so(play, job, directory):
    """The same file works on a laptop. In a cluster, the warning has the reason and the remedy."""
    with capture_logs() as logs:
        code, _ = play(job("PPO", device="cuda"))

    (line,) = missing_gpus(logs)
    assert code == 0
    assert line["event"] == "PyTorch sees no GPU, so the CPU is used"
    assert "TORCH=cuda" in line["remedy"]
    assert PPO.load(directory.model, device="cpu").num_timesteps > 0


@pytest.mark.usefixtures("no_gpu")
def test_a_run_that_asked_for_a_gpu_is_measured_where_there_is_none(play, job, directory, make_member):
    """A policy that was trained in a cluster is evaluated on a laptop; its training.yaml asks for a GPU."""
    play(job())

    with capture_logs() as logs:
        result = measure(
            job(device="cuda"), directory.model, lambda _: [make_member("evaluate-0")], episodes=2, stream="B"
        )

    assert result["episodes"] == 2
    assert len(missing_gpus(logs)) == 1


def test_a_job_that_asks_for_no_gpu_trains_on_the_cpu_without_a_word(monkeypatch, make):
    """A machine with a GPU also uses the CPU, because small networks are faster there and resume exactly."""
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)

    with capture_logs() as logs:
        model, _, _ = make("DQN", "cpu")

    assert model.device == torch.device("cpu")
    assert missing_gpus(logs) == []


@pytest.mark.filterwarnings("ignore:You are trying to run")
@pytest.mark.parametrize("name", ALGORITHMS)
@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("cpu", "cpu"),
        pytest.param("cuda", "cuda", marks=GPU),
        pytest.param("cuda", "cpu", marks=GPU),
        pytest.param("cpu", "cuda", marks=GPU),
    ],
)
def test_a_run_goes_on_from_a_checkpoint_of_either_device(make, tmp_path, name, before, after):
    """After a preemption, the next node may have no GPU, so all tensors must move to the new device."""
    trained, env, configuration = make(name, before)
    trained.learn(40)
    state = checkpoint.TrainingState.of(trained, env.snapshot(), {"returns": [0.0]})
    described = checkpoint.describe(configuration, trained.num_timesteps, {})
    checkpoint.Saver(tmp_path / "checkpoints", keep=1).save(trained, state, described)

    model, env, _ = make(name, after)
    restored = checkpoint.restore(checkpoint.newest(tmp_path / "checkpoints"), model)
    env.resume(restored.members)
    restored.put_back(model)
    steps = model.num_timesteps
    model.learn(40, reset_num_timesteps=False)

    assert steps == trained.num_timesteps
    assert model.num_timesteps >= steps + 40
    assert {parameter.device.type for parameter in model.policy.parameters()} == {after}


def test_where_the_generator_of_a_gpu_stands_is_kept_with_the_others():
    """The GPU's generator draws actions. Without its state, a resumed run would draw the same ones again."""
    space = spaces.Discrete(2)
    now = Generators.now(space, torch.device("cpu"))
    state = torch.arange(16, dtype=torch.uint8)

    read = Generators.from_json(dataclasses.replace(now, gpu=state).to_json())

    assert now.gpu is None
    assert "gpu" not in now.to_json()
    assert torch.equal(read.gpu, state)
