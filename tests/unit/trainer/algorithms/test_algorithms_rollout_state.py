"""A checkpoint keeps each value that an algorithm changes while it collects a rollout."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest
import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.noise import ActionNoise
from torch import nn

from palaestra_trainer.algorithms import ALGORITHMS, make_model
from palaestra_trainer.algorithms.rollout_state import ROLLOUT_STATES, RolloutState, rollout_state_of
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.testing import FakeTask, MaskedTask
from palaestra_trainer.testing.fake_task import ACTIONS, OBSERVATIONS

OFF_POLICY = {"learning_starts": 4, "batch_size": 4, "buffer_size": 60, "train_freq": 6}
ON_POLICY = {"n_steps": 16, "batch_size": 8}
NOISE = {"noise_type": "ornstein-uhlenbeck", "noise_std": 0.2}
HYPERPARAMETERS = {
    "DQN": OFF_POLICY | {"target_update_interval": 2},
    "QRDQN": OFF_POLICY | {"target_update_interval": 2},
    "SAC": OFF_POLICY,
    "TD3": OFF_POLICY | NOISE,
    "DDPG": OFF_POLICY | NOISE,
    "TQC": OFF_POLICY,
    "CrossQ": OFF_POLICY,
    "PPO": ON_POLICY,
    "A2C": {"n_steps": 16},
    "TRPO": ON_POLICY,
    "MaskablePPO": ON_POLICY,
    "RecurrentPPO": ON_POLICY | {"policy_kwargs": {"net_arch": [4], "lstm_hidden_size": 4}},
    "REINFORCE": {"episodes_per_update": 2},
}
# `checkpoint.state` and `checkpoint.experience` save these for each algorithm. A rollout begins with an empty
# rollout buffer.
KEPT = {
    "num_timesteps", "_episode_num", "_current_progress_remaining", "_last_obs", "_last_original_obs",
    "_last_episode_starts", "ep_info_buffer", "ep_success_buffer", "replay_buffer", "rollout_buffer",
    "action_noise",
}  # fmt: skip
NOT_STATE = {"env", "_logger", "policy"}  # the policy's tensors are compared one by one


def print_of(value):
    """Return plain data that is different if the value is different."""
    if isinstance(value, torch.Tensor):
        return value.detach().numpy().tobytes()
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if isinstance(value, list | tuple | deque):
        return [print_of(part) for part in value]
    parts = parts_of(value)
    return repr(value) if parts is None else {key: print_of(part) for key, part in parts.items()}


def parts_of(value):
    """Return the parts of a value by name, or None for a value without parts."""
    if isinstance(value, nn.Module):
        return value.state_dict()
    if isinstance(value, ActionNoise):
        return vars(value)
    return value if isinstance(value, dict) else None


class Changes(BaseCallback):
    """A callback that records which attributes and tensors change during a rollout."""

    def __init__(self):
        super().__init__()
        self.attributes, self.tensors = set(), set()

    def _on_rollout_start(self):
        self._before = self._now()

    def _on_step(self):
        return True

    def _on_rollout_end(self):
        for now, before, found in zip(
            self._now(), self._before, (self.attributes, self.tensors), strict=True
        ):
            found |= {name for name in now if now[name] != before.get(name)}

    def _now(self):
        own = vars(self.model)
        known = {name: print_of(own[name]) for name in own.keys() - NOT_STATE}
        return known, {name: print_of(it) for name, it in self.model.policy.state_dict().items()}


def model_of(name):
    """Return a small model of an algorithm with two simulators."""
    seen, acted = (
        OBSERVATIONS["Box"],
        next(space for space in ACTIONS.values() if isinstance(space, ALGORITHMS[name].actions)),
    )
    task = MaskedTask if name == "MaskablePPO" else FakeTask
    restarters = [Restarter(Member(task(seen, acted))) for _ in range(2)]
    hyperparameters = {"policy_kwargs": {"net_arch": [4]}} | HYPERPARAMETERS[name]
    return make_model(
        Algorithm(name=name, hyperparameters=hyperparameters), SimulatorsVecEnv(restarters, 1), seed=1
    )


class Member:
    """A simulator that never breaks."""

    name = "collect-0"

    def __init__(self, env):
        self.env = env

    def due(self, episodes=1):
        """Return None, because this simulator is never recycled."""
        del episodes


@pytest.mark.parametrize("name", ALGORITHMS)
def test_a_rollout_changes_what_is_declared_and_nothing_else(name):
    """If a release of Stable-Baselines3 adds state, this test fails before a user's resumed run does."""
    model, changes = model_of(name), Changes()

    model.learn(80, changes)

    declared = rollout_state_of(model)
    networks = {
        f"{network}.{tensor}"
        for network in declared.networks
        for tensor in getattr(model, network).state_dict()
    }
    assert changes.attributes - KEPT - set(declared.networks) == {*declared.numbers, *declared.memories}
    assert changes.tensors == networks


@pytest.mark.parametrize("name", ALGORITHMS)
def test_every_algorithm_has_an_entry(name):
    """Without an entry, each checkpoint would contain the whole policy; a base class's entry is enough."""
    assert any(cls in ROLLOUT_STATES for cls in ALGORITHMS[name].original.__mro__)


def test_a_class_without_a_known_ancestor_keeps_its_whole_policy():
    """A rollout may change each part of such a policy, so a checkpoint must contain all parts."""
    model = model_of("PPO")
    stranger = type("Stranger", (), {"policy": model.policy})()

    assert rollout_state_of(stranger) == RolloutState(networks=("policy",))
