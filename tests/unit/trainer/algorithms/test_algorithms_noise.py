"""Noise on actions has a type and a deviation, and differs between simulators."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium import spaces

from palaestra_trainer.algorithms import check, make_model
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.simulators.restarter import Restarter
from tests.unit.trainer.conftest import TINY


def test_noise_on_actions_is_each_members_own(make_member):
    """With common noise, all simulators would explore in the same way.

    The hyperparameters have the names of rl-baselines3-zoo.
    """
    members = [make_member(f"collect-{row}") for row in range(2)]
    for member in members:
        member.env.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
    noisy = {"noise_type": "ornstein-uhlenbeck", "noise_std": 0.5, "learning_starts": 0, "buffer_size": 50}
    wanted = Algorithm(name="TD3", hyperparameters=TINY | noisy)
    check(wanted)

    model = make_model(wanted, SimulatorsVecEnv([Restarter(member) for member in members], 1), seed=1).learn(
        4
    )

    first, second = (noise.noise_prev.item() for noise in model.action_noise.noises)
    assert first != second


@pytest.mark.parametrize(
    ("noise", "fact"),
    [
        ({"noise_type": "normal"}, "noise_std: is missing; noise has a type and a deviation"),
        ({"noise_std": 0.1}, "noise_type: is missing"),
        ({"noise_type": "white", "noise_std": 0.1}, "noise_type: 'white' is not known; use one of normal"),
        ({"noise_type": "normal", "noise_std": -1}, "noise_std: -1 is refused; give a number above 0"),
    ],
)
def test_noise_that_is_half_or_wrong_is_refused(noise, fact):
    """A job with half a setting would otherwise train without noise, and nobody would notice."""
    with pytest.raises(ConfigurationError, match=fact):
        check(Algorithm(name="SAC", hyperparameters=noise))


def test_an_algorithm_without_noise_has_no_such_hyperparameter():
    """The policies of PPO are stochastic, so noise would have no effect."""
    with pytest.raises(ConfigurationError, match="noise_type: PPO has no such hyperparameter"):
        check(Algorithm(name="PPO", hyperparameters={"noise_type": "normal", "noise_std": 0.1}))
