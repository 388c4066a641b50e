"""REINFORCE: the episodes from which it learns, and its updates."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.algorithms import REINFORCE
from palaestra_trainer.algorithms.episodes import EpisodeRecorder, returns_to_go
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.simulators.restarter import Restarter


@pytest.fixture
def make_model(make_member):
    """Return a function that makes a REINFORCE model on corridors, and a list that collects its batches."""

    def make(members=1, faults=(), **options):
        made = [make_member(f"collect-{index}", steps=() if index else faults) for index in range(members)]
        env = SimulatorsVecEnv([Restarter(member) for member in made], run_seed=1)
        options = {"episodes_per_update": 2, "policy_kwargs": {"net_arch": [8]}} | options
        model = REINFORCE("MlpPolicy", env, seed=1, device="cpu", **options)
        batches = []
        learn_from = model.train
        model.train = lambda batch: (batches.append(batch), learn_from(batch))
        return model, batches

    return make


def play(recorder, rows):
    """Add rows to a recorder: for each step and each environment a pair (done, valid)."""
    for step, row in enumerate(rows):
        if recorder.complete:
            return
        dones = np.array([done for done, _ in row])
        valid = np.array([is_valid for _, is_valid in row])
        recorder.add(np.full(len(row), step), np.zeros(len(row)), np.ones(len(row)), dones, valid)


def test_an_environment_that_is_away_is_not_waited_for():
    """The simulator of such an environment may take a minute to restart, or may never come back."""
    recorder = EpisodeRecorder(environments=2, wanted=2)

    play(
        recorder,
        [[(True, True), (True, True)], [(False, True), (True, False)], [(True, True), (False, False)]],
    )

    assert recorder.complete
    assert recorder.batch(gamma=1.0).returns.tolist() == [1.0, 2.0, 1.0, 1.0]


def test_nothing_is_learned_from_nobody():
    """With a single environment, the update waits until its simulator is back."""
    recorder = EpisodeRecorder(environments=1, wanted=1)

    play(recorder, [[(True, False)], [(False, False)], [(True, False)], [(False, True)]])

    assert not recorder.complete


@given(st.lists(st.floats(-10, 10), max_size=30), st.floats(0, 1))
def test_a_return_is_its_reward_and_the_discounted_next_return(rewards, gamma):
    """REINFORCE weights each action by this return; the test computes it by its definition."""
    returns = returns_to_go(rewards, gamma)

    later = [*returns[1:], 0.0][: len(rewards)]
    expected = [reward + gamma * after for reward, after in zip(rewards, later, strict=True)]
    assert returns.tolist() == pytest.approx(expected, rel=1e-4, abs=1e-4)


def test_each_environment_gives_the_same_number_of_episodes():
    """If an update took the first episodes to end, short episodes would be too frequent in it."""
    recorder = EpisodeRecorder(environments=2, wanted=1)

    play(recorder, [[(True, True), (False, True)]] * 2 + [[(True, True), (True, True)]])

    batch = recorder.batch(gamma=1.0)
    assert recorder.complete
    assert batch.observations.tolist() == [0, 0, 1, 2]
    assert batch.returns.tolist() == [1, 3, 2, 1]


def test_an_episode_that_a_fault_cut_is_dropped():
    """The policy would have got another return without the fault."""
    recorder = EpisodeRecorder(environments=1, wanted=1)

    play(recorder, [[(False, True)], [(True, False)], [(True, True)]])

    assert recorder.batch(gamma=1.0).observations.tolist() == [2]


def test_an_update_has_whole_episodes_of_the_current_policy(make_model):
    """Actions of an older policy would bias the gradient, so open episodes begin again at an update."""
    model, batches = make_model(members=2)

    model.learn(20)

    for batch in batches[:-1]:
        assert len(batch.returns) == len(batch.actions) == len(batch.observations)
        starts = [row for row in batch.observations if row[0] == 0.0]
        assert len(starts) >= 4


def test_training_ends_at_the_first_episode_end_after_the_last_step(make_model):
    """An episode has no return before its end, so the last episode is completed."""
    model, batches = make_model(episodes_per_update=1000)

    model.learn(10)

    assert 10 <= model.num_timesteps < 10 + 8
    assert len(batches[0].returns) == model.num_timesteps


def test_a_fault_is_neither_step_nor_episode(make_model):
    """The fault at step 2 cuts the first episode: its one valid row is a step, but is not learned from."""
    model, batches = make_model(faults=(2,))

    model.learn(5)

    assert sum(len(batch.returns) for batch in batches) == model.num_timesteps - 1


def test_nothing_to_learn_from_changes_nothing(make_model):
    """Faults may have cut all episodes of an update."""
    model, batches = make_model(faults=(2,))
    before = [it.clone() for it in model.policy.parameters()]
    model.learn(5)

    empty = EpisodeRecorder(1, 1).batch(0.9)
    after_learning = [it.clone() for it in model.policy.parameters()]
    model.train(empty)

    assert batches
    assert any(not torch.equal(one, other) for one, other in zip(before, after_learning, strict=True))
    assert all(
        torch.equal(one, other) for one, other in zip(after_learning, model.policy.parameters(), strict=True)
    )


@pytest.mark.parametrize("baseline", ["value", "none"])
def test_the_value_network_learns_only_as_baseline(make_model, baseline):
    """Without the baseline, no loss uses the value network."""
    model, _ = make_model(baseline=baseline)
    before = model.policy.value_net.weight.clone()

    model.learn(20)

    assert torch.equal(before, model.policy.value_net.weight) is (baseline == "none")


def test_without_a_baseline_nothing_is_subtracted_from_the_returns(make_model):
    """Subtracting the mean of the returns would also be a baseline, so the returns are only scaled."""
    model, _ = make_model(baseline="none")
    returns = torch.tensor([1.0, 7.0, 5.0, 5.0])

    advantages = model._advantages(returns, values=torch.full((4,), 3.0))

    assert torch.allclose(advantages, returns / 5.0)


def test_a_callback_can_end_training(make_model):
    """Other algorithms end in the same way if a callback returns False."""
    model, batches = make_model()

    model.learn(100, callback=lambda locals_, _: locals_["self"].num_timesteps < 5)

    assert model.num_timesteps == 5
    assert batches == []


@pytest.mark.parametrize(("option", "value"), [("baseline", "mean"), ("episodes_per_update", 0)])
def test_the_error_for_a_wrong_hyperparameter_names_it(make_model, option, value):
    """The hyperparameters come from a job, whose author must find the wrong one."""
    with pytest.raises(ValueError, match=option):
        make_model(**{option: value})
