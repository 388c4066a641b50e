"""Several simulators as a vector environment for gymnasium and Stable-Baselines3, without invalid rows."""

from __future__ import annotations

import threading

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from sb3_contrib import MaskablePPO
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

from palaestra_trainer.errors import FaultBudgetSpent
from palaestra_trainer.run.fault_tolerant.sb3_vec_env import FaultTolerantVecEnv
from palaestra_trainer.run.fault_tolerant.vector_env import FaultTolerantVectorEnv
from palaestra_trainer.testing import MaskedTask
from palaestra_trainer.testing.fake_task import ACTIONS, OBSERVATIONS

RIGHT, LEFT = 1, 0


@pytest.fixture
def make_env(make_players, make_member):
    """Return a function that makes a vector environment; each dictionary sets the faults of a simulator."""

    def make(*faults, kind=FaultTolerantVectorEnv, restarts=10):
        members = [make_member(f"collect-{index}", **given) for index, given in enumerate(faults)]
        players = make_players(*members, restarts=restarts, deadline_s=20.0)
        return kind(players), members, players

    return make


def walk(env, steps, action=RIGHT):
    """Return the results of some steps with the same action."""
    return [env.step(np.full(env.num_envs, action)) for _ in range(steps)]


def test_a_vector_is_gymnasium_s_own_in_everything_but_faults(make_env, make_member):
    """A loop that was written for gymnasium's vectors must work without changes.

    Both vectors reset an environment in the same step.
    """
    ours, *_ = make_env({}, {})
    theirs = SyncVectorEnv(
        [lambda: make_member("a").env, lambda: make_member("b").env], autoreset_mode=AutoresetMode.SAME_STEP
    )

    results = [(env.reset(seed=[4, 9]), *walk(env, 3)) for env in (ours, theirs)]

    for mine, other in zip(*results, strict=True):
        for part, wanted in zip(mine[1:-1], other[1:-1], strict=True):
            assert part.dtype == wanted.dtype
            assert part.tolist() == wanted.tolist()
    mine, other = (result[-1] for result in results)
    assert mine[0].dtype == other[0].dtype
    assert set(mine[4]) == set(other[4])
    assert np.stack(list(mine[4]["final_obs"])).tolist() == np.stack(list(other[4]["final_obs"])).tolist()
    assert mine[4]["final_info"]["is_success"].tolist() == [True, True]
    assert ours.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space


def test_the_step_of_a_fault_waits_and_begins_the_next_episode(make_env):
    """The row has the first observation of the next episode.

    The last one is in the info, where loops look for it.
    """
    env, members, _ = make_env({"steps": [2], "held": True}, {})
    env.reset(seed=[1, 2])
    walk(env, 1)
    threading.Timer(0.05, members[0].release.set).start()

    observations, rewards, terminations, truncations, infos = walk(env, 1)[0]

    assert members[0].log == ["restart"]
    assert observations[:, 0].tolist() == pytest.approx([0.0, 0.2])
    assert rewards.tolist() == [0.0, -0.1]
    assert (terminations.tolist(), truncations.tolist()) == ([False, False], [True, False])
    assert infos["final_obs"][0][0] == np.float32(0.1)
    assert infos["final_info"]["palaestra"]["sim_fault"]["kind"].tolist() == ["dead", None]
    assert infos["final_info"]["palaestra"]["_sim_fault"].tolist() == [True, False]


def test_several_simulators_that_break_in_one_step_are_mended_at_once(make_env):
    """Restarts one after the other would take longer, so each simulator is restarted by its own thread."""
    env, members, _ = make_env({"steps": [2]}, {"steps": [2], "resets": [2]}, {})
    env.reset(seed=1)

    _, _, _, truncations, infos = walk(env, 2)[-1]

    assert truncations.tolist() == [True, True, False]
    assert [member.log for member in members] == [["restart"], ["restart", "restart"], []]
    assert infos["final_info"]["palaestra"]["_sim_fault"].tolist() == [True, True, False]


def test_no_row_of_many_steps_with_faults_is_invalid(make_env):
    """A loop without code for faults learns from each row, so each row must be valid."""
    env, members, _ = make_env(
        {"steps": range(5, 100, 7), "resets": [3]}, {"steps": range(3, 100, 11)}, restarts=40
    )
    env.reset(seed=1)
    env.action_space.seed(1)

    for _ in range(90):
        observations, rewards, *_, infos = env.step(env.action_space.sample())
        assert observations in env.observation_space
        assert np.isfinite(rewards).all()
        assert "recovering" not in infos

    assert all("restart" in member.log for member in members)


def test_episodes_have_the_seeds_of_their_member(make_env):
    """A program passes one seed for all simulators or one for each; NumPy integers are accepted."""
    env, members, _ = make_env({}, {})

    env.reset(seed=np.int64(5))
    walk(env, 3)
    env.reset(seed=[5, 6])
    walk(env, 3)

    for member, seed in zip(members, (5, 6), strict=True):
        assert member.env.seeds[0] == seed
        assert member.env.seeds[:2] == member.env.seeds[2:]
    with pytest.raises(ValueError, match="3 seeds for 2 environments"):
        env.reset(seed=[1, 2, 3])


def test_options_reach_every_environment(make_env):
    """With the options `start` and `target`, for example, a program chooses an episode."""
    env, members, _ = make_env({}, {})

    env.reset(options={"easy": True})

    assert [member.env.options for member in members] == [{"easy": True}] * 2


def test_a_member_that_breaks_too_often_ends_the_loop_with_a_typed_error(make_env):
    """A vector cannot step without one of its simulators."""
    env, *_ = make_env({"resets": range(1, 20)}, {}, restarts=1)

    with pytest.raises(FaultBudgetSpent, match="collect-0"):
        env.reset()


def test_gymnasium_s_wrappers_for_vectors_can_be_put_around_it(make_env):
    """The scripts of CleanRL use these wrappers."""
    env, *_ = make_env({"steps": [2]}, {})
    wrapped = gymnasium.wrappers.vector.RecordEpisodeStatistics(env)
    wrapped.reset(seed=1)

    infos = [wrapped.step(np.full(2, RIGHT))[4] for _ in range(3)]

    assert infos[1]["episode"]["l"].tolist() == [2, 0]
    assert infos[2]["_episode"].tolist() == [False, True]


def test_closing_a_vector_releases_its_simulators(make_env):
    """Another vector can then use the simulators; a second `close` changes nothing."""
    env, _, players = make_env({}, {})

    env.close()
    env.close()

    assert players.released == [1]


def test_stable_baselines3_gets_the_row_that_it_expects(make_env):
    """Stable-Baselines3 expects a reset in the same step, and the last observation in the info."""
    env, *_ = make_env({}, {}, kind=FaultTolerantVecEnv)
    env.seed(3)
    first = env.reset()

    observations, rewards, dones, infos = walk(env, 3)[-1]

    assert first.tolist() == [pytest.approx([0.0, 0.3]), pytest.approx([0.0, 0.4])]
    assert rewards.dtype == np.float32
    assert dones.tolist() == [True, True]
    assert observations[:, 0].tolist() == [0.0, 0.0]
    assert infos[0]["terminal_observation"][0] == np.float32(0.3)
    assert infos[0]["TimeLimit.truncated"] is False
    assert (infos[0]["episode"]["r"], infos[0]["episode"]["l"]) == (pytest.approx(0.8), 3)
    assert env.reset_infos[0]["seed"] is not None


def test_stable_baselines3_counts_no_episode_that_a_fault_cut(make_env):
    """The return of a cut episode does not measure the policy.

    The value of its last observation is bootstrapped.
    """
    env, *_ = make_env({"steps": [2]}, {}, kind=FaultTolerantVecEnv)
    env.reset()

    _, _, dones, infos = walk(env, 2)[-1]

    assert dones.tolist() == [True, False]
    assert infos[0]["TimeLimit.truncated"] is True
    assert infos[0]["palaestra"]["sim_fault"]["kind"] == "dead"
    assert "episode" not in infos[0]


def test_stable_baselines3_learns_in_it(make_env):
    """Stable-Baselines3 uses wrappers, seeds and attributes of the vector."""
    env, members, _ = make_env({"steps": [7]}, {"steps": [11]}, kind=FaultTolerantVecEnv)

    model = PPO("MlpPolicy", VecMonitor(env), n_steps=16, batch_size=8, seed=1).learn(64)

    assert model.num_timesteps == 64
    assert [member.log for member in members] == [["restart"], ["restart"]]
    assert members[1].env.seeds[0] == 2
    assert env.get_attr("step_reward") == [-0.1, -0.1]


@pytest.fixture
def make_masked(make_players, make_member):
    """Return a vector of two tasks with masks; the first one breaks in its fourth step."""

    def make(kind):
        members = [make_member(f"collect-{index}") for index in range(2)]
        for member, deaths in zip(members, [(4,), ()], strict=True):
            member.env = task = MaskedTask(OBSERVATIONS["Box"], ACTIONS["Discrete"], deaths)
            member.restart = task.restart
        return kind(make_players(*members, deadline_s=20.0))

    return make


def test_sb3_contrib_asks_for_masks_by_its_own_names(make_masked):
    """The task fails at a forbidden action, so MaskablePPO must get the masks before and after a fault."""
    model = MaskablePPO("MlpPolicy", make_masked(FaultTolerantVecEnv), n_steps=16, batch_size=8, device="cpu")

    model.learn(64)

    assert model.num_timesteps == 64


def test_a_loop_of_gymnasium_asks_for_masks_of_all(make_masked):
    """As with gymnasium's own vectors, the loop uses `call`."""
    env = make_masked(FaultTolerantVectorEnv)
    env.reset(seed=[1, 2])

    for _ in range(12):
        masks = env.call("action_masks")
        env.step(np.array([int(np.flatnonzero(mask)[-1]) for mask in masks]))
