"""The state of an episode is its number and its actions; playing the actions again restores the episode."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium import spaces

from palaestra_trainer.episodes.episode_state import ActionLog, EpisodeState
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.simulators.restarter import Restarter

RIGHT, LEFT = 1, 0


@pytest.fixture
def make_env(make_member):
    """Return a function that makes a VecEnv of corridors; an argument sets the faults of a simulator."""

    def make(*faults, run_seed=1):
        members = [make_member(f"collect-{index}", **given) for index, given in enumerate(faults)]
        return SimulatorsVecEnv([Restarter(member) for member in members], run_seed), members

    return make


def play(env, actions):
    """Return the results of vector steps with these actions, the same for all simulators."""
    return [env.step(np.full(env.num_envs, action)) for action in actions]


def told(rows):
    """Return the parts of some rows that must be equal when the rows are repeated."""
    return [
        (observations.tolist(), rewards.tolist(), dones.tolist(), [told_of(info) for info in infos])
        for observations, rewards, dones, infos in rows
    ]


def told_of(info):
    """Return the return and the length of the episode that ends with this info."""
    episode = info.get("episode")
    return episode and (episode["r"], episode["l"])


def test_before_the_first_reset_no_episode_is_under_way(make_env):
    """A signal may interrupt a run while its simulators start."""
    env, _ = make_env({}, {})

    assert [(state.episode, state.actions) for state in env.snapshot()] == [(0, None)] * 2


def test_a_snapshot_has_the_episode_s_number_and_its_actions(make_env):
    """The number gives the seed, and the actions lead to the same state."""
    env, _ = make_env({})
    env.reset()
    play(env, [RIGHT, RIGHT, RIGHT, LEFT, RIGHT])

    (state,) = env.snapshot()

    assert state.episode == 1
    assert state.actions.tolist() == [LEFT, RIGHT]


def test_a_snapshot_stays_as_it_was(make_env):
    """A checkpoint may be written after the next steps."""
    env, _ = make_env({})
    env.reset()
    play(env, [LEFT] * 2)
    (state,) = env.snapshot()

    play(env, [LEFT] * 5)
    env.reset()
    play(env, [RIGHT] * 2)

    assert (state.episode, state.actions.tolist()) == (0, [LEFT] * 2)


@pytest.mark.parametrize("steps", range(12))
def test_what_follows_a_resume_is_what_would_have_been(make_env, steps):
    """An exact resume must give the same observations, rewards, ends, returns and lengths."""
    actions = [RIGHT, LEFT, RIGHT, RIGHT, LEFT, RIGHT, RIGHT, RIGHT, LEFT, RIGHT, RIGHT, RIGHT] * 2
    env, _ = make_env({}, {})
    env.reset()
    last = play(env, actions[:steps])[-1][0] if steps else env.reset()
    states = env.snapshot()

    again, members = make_env({}, {})
    observations = again.resume(states)

    assert observations.tolist() == last.tolist()
    assert told(play(again, actions[steps:])) == told(play(env, actions[steps:]))
    assert [it.episode for it in again.snapshot()] == [it.episode for it in env.snapshot()]
    assert len(members[0].env.seeds) <= len(actions)


def test_members_are_resumed_where_each_one_was(make_env):
    """The simulators are independent, so each may be at another step, and one may have no episode."""
    env, members = make_env({}, {}, {})

    observations = env.resume(
        [EpisodeState(4, np.array([RIGHT])), EpisodeState(2, np.array([], np.int64)), EpisodeState(9, None)]
    )

    assert observations[:, 0].tolist() == [np.float32(0.1), 0.0, 0.0]
    assert [state.episode for state in env.snapshot()] == [4, 2, 9]
    assert [info["seed"] for info in env.reset_infos] == [member.env.seeds[-1] for member in members]


def test_an_episode_that_ends_early_when_it_is_played_again_is_left(make_env):
    """The environment is not deterministic, so the saved actions do not fit any more.

    The next episode begins.
    """
    env, _ = make_env({})

    observations = env.resume([EpisodeState(4, np.array([RIGHT] * 5))])

    assert observations[0][0] == 0.0
    assert env.snapshot()[0].episode == 5


@pytest.mark.parametrize("action", [1, np.int64(1), np.float32(0.5), np.zeros((2, 3), np.float32)])
def test_a_log_keeps_actions_as_they_are(action):
    """Actions of another type could be refused when the episode is played again."""
    log = ActionLog()
    early = log.taken()
    for _ in range(40):
        log.append(action)

    assert len(early) == 0
    assert log.taken().shape == (40, *np.shape(action))
    assert log.taken().dtype == np.asarray(action).dtype
    assert (log.taken() == action).all()


def test_continuous_actions_are_kept_by_row():
    """An action of velocities consists of several numbers."""
    log = ActionLog()
    space = spaces.Box(-1.0, 1.0, (3,), np.float32, seed=1)
    wanted = [space.sample() for _ in range(20)]
    for action in wanted:
        log.append(action)

    assert log.taken().tobytes() == np.array(wanted).tobytes()
