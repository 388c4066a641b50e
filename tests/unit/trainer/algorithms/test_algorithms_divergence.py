"""The check for NaN and infinity: the numbers that it covers, and its message."""

from __future__ import annotations

import math

import pytest
import torch
from stable_baselines3.common.logger import Logger

from palaestra_trainer import algorithms
from palaestra_trainer.algorithms.divergence import Learner
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import Diverged
from palaestra_trainer.simulators.restarter import Restarter

ALL = ("DQN", "PPO", "A2C", "REINFORCE")


@pytest.fixture
def model(job, make_member):
    """Return a function that makes a model of an algorithm in a corridor; its logger writes nothing."""

    def make(name):
        env = SimulatorsVecEnv([Restarter(make_member())], run_seed=1)
        made = algorithms.make_model(job(name).algorithm, env, 1)
        made.set_logger(Logger(folder=None, output_formats=[]))
        return made

    return make


@pytest.mark.parametrize("name", ALL)
def test_a_new_model_holds_numbers_only(model, name):
    """A model without training must pass the check."""
    assert Learner(model(name)).not_finite() == ""


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_one_wrong_number_in_any_tensor_is_found_and_named(model, name, number):
    """A wrong weight at the end of the last layer may affect no output at first."""
    made = model(name)
    learner = Learner(made)
    for tensor, parameter in made.policy.named_parameters():
        whole = parameter.detach().clone()
        with torch.no_grad():
            parameter.view(-1)[-1] = number

            assert learner.not_finite() == f"{tensor} holds {number}"
            parameter.copy_(whole)


def test_a_refusal_names_step_loss_and_tensors(model):
    """A person sees where the numbers are wrong, and what to change."""
    made = model("PPO")
    made.logger.record("train/value_loss", math.inf)
    with torch.no_grad():
        for parameter in made.policy.parameters():
            parameter.fill_(math.nan)

    with pytest.raises(Diverged) as refusal:
        Learner(made).check(120)

    count = len(list(made.policy.parameters()))
    first = next(name for name, _ in made.policy.named_parameters())
    assert str(refusal.value) == (
        f"step 120: train/value_loss is inf, {first} holds nan and {count - 1} other tensors; "
        "lower algorithm.hyperparameters.learning_rate or clip gradients harder"
    )


def test_a_figure_that_is_no_loss_may_be_unknown(model):
    """If all returns are equal, the explained variance is NaN, but the training has not diverged."""
    made = model("PPO")
    made.logger.record("train/explained_variance", math.nan)
    made.logger.record("rollout/loss", math.nan)

    assert Learner(made).not_finite() == ""


def test_very_large_numbers_are_numbers(model):
    """The norm of a tensor overflows to infinity although each of its numbers is finite."""
    made = model("PPO")
    with torch.no_grad():
        for parameter in made.policy.parameters():
            parameter.fill_(3e38)

    assert Learner(made).not_finite() == ""


def test_a_coefficient_that_is_learnt_beside_the_networks_is_looked_at_too(model):
    """The temperature of SAC is a tensor of the model and not of a network."""
    made = model("PPO")
    made.log_ent_coef = torch.tensor([math.nan])

    assert Learner(made).not_finite() == "log_ent_coef holds nan"
