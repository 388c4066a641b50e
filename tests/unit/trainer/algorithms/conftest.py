"""A user's module with classes and functions, and models of these classes in the corridor."""

from __future__ import annotations

import sys

import pytest

from palaestra_trainer.algorithms import make_model
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.simulators.restarter import Restarter
from tests.unit.trainer.conftest import TINY

LAB = '''
import sb3_contrib
import stable_baselines3 as sb3
import torch
from sb3_contrib.common.maskable.buffers import MaskableRolloutBuffer
from stable_baselines3.common.buffers import ReplayBuffer, RolloutBuffer
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import FlattenExtractor


class Careful(sb3.PPO):
    """PPO with one more hyperparameter."""

    def __init__(self, *args, care: float = 0.5, **kwargs):
        self.care = care
        super().__init__(*args, **kwargs)


class Search(sb3_contrib.ARS):
    """ARS under another name."""


class Masked(sb3.PPO):
    """PPO with the rollout buffer of MaskablePPO, although PPO stores no masks in it."""

    def _setup_model(self):
        super()._setup_model()
        self.rollout_buffer = MaskableRolloutBuffer(
            self.n_steps, self.observation_space, self.action_space, n_envs=self.n_envs
        )


class Eager(sb3.DQN):
    """DQN under another name."""


class OwnRollouts(sb3.PPO):
    """PPO with another kind of rollout buffer."""

    def _setup_model(self):
        super()._setup_model()

        class Own(RolloutBuffer):
            pass

        self.rollout_buffer = Own(self.n_steps, self.observation_space, self.action_space, n_envs=self.n_envs)


class OwnReplay(sb3.DQN):
    """DQN with another kind of replay buffer."""

    def _setup_model(self):
        super()._setup_model()
        self.replay_buffer = ReplayBuffer(10, self.observation_space, self.action_space)


def halving(left):
    return 0.01 * 0.5 ** (4 * (1 - left))


def rising(left):
    return -left


def failing(left):
    raise RuntimeError("no rate today")


class Doubled(FlattenExtractor):
    """Features that are twice the observation."""

    def forward(self, observations):
        return 2.0 * super().forward(observations)


class Scribbling(FlattenExtractor):
    """An extractor that overwrites the observation."""

    def forward(self, observations):
        return super().forward(observations.mul_(0.5))


class ScribblingPolicy(ActorCriticPolicy):
    """A policy that overwrites the observation."""

    def forward(self, obs, deterministic=False):
        return super().forward(obs.mul_(0.5), deterministic)


class Picky(FlattenExtractor):
    """An extractor that accepts only observations of a Dict."""

    def __init__(self, observation_space):
        observation_space["sensors"]


class Hasty(FlattenExtractor):
    """An extractor that reads an attribute which does not exist."""

    def __init__(self, observation_space):
        self.missing


class Lost(FlattenExtractor):
    """An extractor that reads a missing key."""

    def __init__(self, observation_space):
        {}["units"]


class OwnPolicy(ActorCriticPolicy):
    """The usual policy under another name."""


class Calm(torch.nn.Module):
    """An activation function."""

    def forward(self, x):
        return torch.tanh(x / 2)


class Slow(torch.optim.SGD):
    """An optimizer."""


def no_class():
    """Return nothing."""
'''
ROLLOUTS = TINY | {"n_steps": 16, "batch_size": 8}


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """Write a user's module into a folder on the import path, and return the folder."""
    (tmp_path / "my_lab.py").write_text(LAB)
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    sys.modules.pop("my_lab", None)


@pytest.fixture
def corridor_model(make_member):
    """Return a function that makes a model of an algorithm in the corridor.

    The first simulator dies at the steps `faults`.
    """

    def made(algorithm, faults=()):
        members = [make_member("collect-0", steps=faults), make_member("collect-1")]
        return make_model(algorithm, SimulatorsVecEnv([Restarter(member) for member in members], 1), seed=1)

    return made
