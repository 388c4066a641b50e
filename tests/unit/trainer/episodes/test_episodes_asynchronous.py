"""Asynchronous collection: a slow simulator does not hold back the others, and no row is mixed up."""

from __future__ import annotations

import numpy as np
import pytest

from palaestra_trainer.algorithms import make_model
from palaestra_trainer.algorithms.begun_actions import BegunActions
from palaestra_trainer.environments.infos import is_pending, is_valid
from palaestra_trainer.episodes.asynchronous_vec_env import AsynchronousVecEnv
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.waiting.greenlets import let_others
from tests.unit.trainer.episodes.walking import LEFT, RIGHT


@pytest.fixture
def make_env():
    """Return a function that makes the asynchronous environment of some members, and close it at the end."""
    made = []

    def make(*members):
        made.append(AsynchronousVecEnv([Restarter(member) for member in members], 0))
        return made[-1]

    yield make
    for env in made:
        env.close()


@pytest.fixture
def make_slow(make_member):
    """Return a function that makes a member which lets the others run a number of times in each step."""

    def make(turns, **faults):
        member = make_member("slow", **faults)
        take = member.take_step

        def take_step():
            for _ in range(turns):
                let_others()
            take()

        member.take_step = take_step
        return member

    return make


def test_a_step_returns_while_a_slow_simulator_computes(make_env, make_member, make_slow):
    """One simulator that is ten times slower would otherwise slow down all others by this factor."""
    env = make_env(make_member("fast"), make_slow(turns=3))
    first = env.reset()

    rows = [env.step(np.full(2, RIGHT)) for _ in range(4)]

    assert [is_valid(infos[0]) for *_, infos in rows] == [True] * 4
    assert [is_pending(infos[1]) for *_, infos in rows] == [True, True, True, False]
    assert [is_valid(infos[1]) for *_, infos in rows] == [False, False, False, True]
    for observations, rewards, dones, _ in rows[:3]:
        assert (observations[1] == first[1]).all(), "a pending row repeats the observation"
        assert (rewards[1], dones[1]) == (0.0, False)
    assert rows[3][0][1][0] == pytest.approx(0.1)


def test_the_row_of_a_slow_step_belongs_to_the_action_with_which_it_began(make_env, make_member, make_slow):
    """A replay buffer with another action would teach the learner a wrong transition."""
    env, begun = make_env(make_member("fast"), make_slow(turns=2)), BegunActions()
    env.reset()

    taken = []
    for actions in ([RIGHT, RIGHT], [RIGHT, LEFT], [LEFT, LEFT]):
        *_, infos = env.step(np.array(actions))
        taken.append(begun.taken(np.array(actions), infos).tolist())

    assert taken == [[RIGHT, RIGHT], [RIGHT, LEFT], [LEFT, RIGHT]]


def test_a_slow_simulator_that_dies_truncates_its_episode_only(make_env, make_member, make_slow):
    """A fault in the background must reach the row of its simulator."""
    env = make_env(make_member("fast"), make_slow(turns=2, steps={1}))
    env.reset()

    rows = [env.step(np.full(2, RIGHT)) for _ in range(3)]

    *_, dones, infos = rows[2]
    assert dones.tolist()[1]
    assert infos[1]["palaestra"]["sim_fault"]["simulator"] == "slow"
    assert is_valid(infos[0])


def test_a_pause_waits_for_pending_steps_and_loses_no_row(make_env, make_member, make_slow):
    """A simulator that is paused in the middle of a step would look as if it hung."""
    fast, slow = make_member("fast"), make_slow(turns=5)
    env = make_env(fast, slow)
    env.reset()
    env.step(np.full(2, RIGHT))

    env.pause()
    env.unpause()
    observations, _, _, infos = env.step(np.full(2, RIGHT))

    assert slow.log[-2:] == ["pause", "run"]
    assert [is_valid(info) for info in infos] == [True, True]
    assert observations[1][0] == pytest.approx(0.1)


def test_an_error_of_a_pending_step_is_raised_in_a_later_step(make_env, make_member, make_slow):
    """An error in code of the job's author must end the run, even if it is noticed some steps later."""
    slow = make_slow(turns=1)
    env = make_env(make_member("fast"), slow)
    env.reset()
    slow.env.step_reward = float("nan")

    env.step(np.full(2, RIGHT))
    with pytest.raises(ArithmeticError, match="slow"):
        env.step(np.full(2, RIGHT))


@pytest.mark.parametrize("name", ["DQN", "QRDQN"])
def test_every_stored_row_is_a_step_of_the_simulator(make_env, make_member, make_slow, name):
    """The learner gets all simulators' steps, and makes as many updates per row as without a slow one."""
    env = make_env(make_member("fast"), make_slow(turns=3))
    hyperparameters = {"learning_starts": 10, "train_freq": 4, "buffer_size": 500, "gradient_steps": 1}
    model = make_model(Algorithm(name=name, hyperparameters=hyperparameters), env, 1, "cpu")

    model.learn(200)

    buffer = model.replay_buffer
    rows = buffer.size()
    moved = (buffer.next_observations - buffer.observations)[:rows, 0, 0]
    meant = np.where(buffer.actions[:rows, 0, 0] == RIGHT, 0.1, -0.1)
    assert model.num_timesteps == rows == 200
    assert moved == pytest.approx(meant, abs=1e-6)
    assert model._n_updates == pytest.approx((200 - 10) / 8, abs=2)
