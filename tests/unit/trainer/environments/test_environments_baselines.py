"""Policies without training succeed sometimes, but not often enough."""

from __future__ import annotations

import pytest

from palaestra_trainer.environments.baselines import (
    BASELINES,
    random_movement,
    straight_to_target,
    success_rate,
)

SEEDS = range(200)


def test_driving_straight_succeeds_until_something_is_in_the_way(make_env):
    """The cylinders make the task difficult, so a trained policy can do better."""
    rate = success_rate(make_env(), straight_to_target, SEEDS)

    assert 0.15 < rate < 0.5


def test_random_movements_hardly_ever_succeed(make_env):
    """If random movements often succeeded, the success of a trained policy could be luck."""
    assert success_rate(make_env(), random_movement, SEEDS) < 0.1


@pytest.mark.parametrize("policy", BASELINES.values(), ids=BASELINES)
@pytest.mark.parametrize("actions", ["discrete", "continuous"])
def test_baselines_play_whatever_can_be_configured(make_env, policy, actions):
    """A baseline can be compared with a policy only if it plays the same task, whatever its options."""
    env = make_env(actions=actions, observe=["time_left"], reward="Sparse")
    env.reset(seed=1)

    assert env.action_space.contains(policy(env))


@pytest.mark.parametrize("policy", BASELINES.values(), ids=BASELINES)
def test_a_baseline_is_measured_the_same_twice(make_env, policy):
    """The result is printed next to that of a trained policy, and must be reproducible."""
    rates = [success_rate(make_env(), policy, range(20)) for _ in range(2)]

    assert rates[0] == rates[1]


def test_straight_means_straight_also_in_a_continuous_space(make_env):
    """A continuous action can point in every direction, so the robot drives no zigzag."""
    env = make_env(actions="continuous")
    env.reset(options={"start": (0.0, 0.0, 0.3), "target": (1.5, 0.2)})

    rate_of_zigzag = abs(env.situation.target_ahead[1] / env.situation.target_ahead[0])
    action = straight_to_target(env)

    assert abs(action[1] / action[0]) == pytest.approx(rate_of_zigzag, rel=1e-4)
