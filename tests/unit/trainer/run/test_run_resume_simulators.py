"""At a resume, each simulator plays its saved episode again up to the checkpoint."""

from __future__ import annotations

import json

import numpy as np
import pytest
import structlog

from palaestra_trainer.algorithms import make_model
from palaestra_trainer.episodes.episode_state import EpisodeState
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.resume import rejoin
from palaestra_trainer.simulators.restarter import Restarter

TINY = {"name": "A2C", "hyperparameters": {"n_steps": 5, "policy_kwargs": {"net_arch": [4]}}}


@pytest.fixture
def make_env(make_member):
    """Return a function that makes a VecEnv of corridors; faults are given by row."""

    def make(members=2, faults=()):
        return SimulatorsVecEnv(
            [Restarter(make_member(f"collect-{row}", **dict(faults).get(row, {}))) for row in range(members)],
            1,
        )

    return make


@pytest.fixture
def saved(make_env, make_configuration):
    """Return the state of a model in training, while two simulators are in the middle of an episode."""
    env = make_env()
    model = make_model(make_configuration(algorithm=TINY).algorithm, env, seed=1)
    model.learn(10)
    state = checkpoint.TrainingState.of(model, env.snapshot(), {"terms": [{"walk": 1.0}, {"walk": 2.0}]})
    assert all(len(member.actions) for member in state.members)
    return state


def rejoined(env, saved):
    """Return the state after a resume, and the warnings about simulators that do not repeat themselves."""
    with structlog.testing.capture_logs() as logs:
        state = rejoin(env, saved)
    return state, [line["event"] for line in logs if "do not repeat" in line["event"]]


def test_simulators_that_repeat_themselves_are_where_they_were(make_env, saved):
    """A warning without a cause would make a person doubt an exact resume."""
    state, warnings = rejoined(make_env(), saved)

    assert state is saved
    assert warnings == []


def test_training_warns_of_a_simulator_that_does_not_repeat_itself_and_goes_on(make_env, saved):
    """Most physics engines are not deterministic.

    The policy must get the present observation, not the saved one.
    """
    env = make_env()
    env.seed(2)

    state, warnings = rejoined(env, saved)

    assert len(warnings) == 1
    assert not np.array_equal(state.observation, saved.observation)
    assert not state.episode_starts.any()


def test_a_simulator_that_breaks_meanwhile_begins_its_next_episode(make_env, saved):
    """Rewards of the cut episode are dropped, and nothing is bootstrapped. The other simulator continues."""
    state, warnings = rejoined(make_env(faults={0: {"steps": [1]}}), saved)

    assert warnings == []
    assert state.episode_starts.tolist() == [True, bool(saved.episode_starts[1])]
    assert state.rollout["terms"] == [{}, {"walk": 2.0}]
    assert state.members[0].episode == saved.members[0].episode + 1
    assert state.members[1].episode == saved.members[1].episode


def test_a_simulator_that_was_broken_begins_the_episode_it_was_about_to(make_env, saved):
    """The checkpoint is from before the first step of that episode, so the episode begins now."""
    broken = [EpisodeState(saved.members[0].episode + 1, None), saved.members[1]]

    state, warnings = rejoined(make_env(), checkpoint.TrainingState(**fields(saved) | {"members": broken}))

    assert warnings == []
    assert state.episode_starts[0]
    assert state.members[0].episode == broken[0].episode


@pytest.mark.parametrize("members", [1, 3])
def test_a_run_may_go_on_with_another_number_of_simulators(make_env, saved, members):
    """A new simulator begins its first episode, and the episodes of removed simulators are dropped."""
    state, _ = rejoined(make_env(members), saved)

    assert len(state.members) == len(state.episode_starts) == len(state.observation) == members
    assert state.rollout["terms"] == [{"walk": 1.0}, {"walk": 2.0}, {}][:members]


@pytest.mark.parametrize("name", ["DQN", "PPO", "REINFORCE"])
@pytest.mark.parametrize("collectors", [(1, 3), (3, 1)])
def test_a_run_with_another_number_of_simulators_ends(play, job, directory, name, collectors):
    """A run with a replay buffer is tested too, because its buffer keeps a row for each simulator."""
    before, after = collectors
    play(job(name, collectors=before))

    code, _ = play(job(name, collectors=after, steps=200))

    assert code == 0
    assert json.loads(directory.summary.read_text())["steps"] >= 200


def fields(state):
    """Return the fields of a state."""
    return {name: getattr(state, name) for name in state.__slots__}


def test_an_episode_that_begins_anew_owes_no_reward_to_the_one_before(make_env, make_configuration):
    """Rewards are normalized by the discounted return of the episode, and a new episode begins with 0."""
    env = make_env()
    model = make_model(make_configuration(algorithm=TINY | {"normalize": {}}).algorithm, env, seed=1)
    model.learn(10)
    before = checkpoint.TrainingState.of(model, env.snapshot(), {"terms": [{}, {}]})

    after, _ = rejoined(make_env(faults={1: {"resets": [1]}}), before)

    assert all(before.running_returns)
    assert after.running_returns.tolist() == [before.running_returns[0], 0.0]
