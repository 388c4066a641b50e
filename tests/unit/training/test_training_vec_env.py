"""Several simulators as one VecEnv, and what becomes of their faults."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium import Wrapper, spaces
from stable_baselines3.common.vec_env import VecEnv

from palaestra_trainer.errors import FaultBudgetSpent, MasterLost, SimulatorHung, WrongData
from palaestra_trainer.seeds import COLLECT, episode_seed
from palaestra_trainer.simulators.member import Care, Keeper
from palaestra_trainer.simulators.vec_env import SimulatorsVecEnv
from palaestra_trainer.turns import let_others

RIGHT, LEFT = 1, 0


@pytest.fixture
def make_env():
    """Make a VecEnv of members and close it in the end."""
    made = []

    def make(*members, care=None, run_seed=1, episodes=None):
        keepers = [Keeper(member, care) for member in members]
        env = SimulatorsVecEnv(keepers, run_seed, episodes=episodes)
        made.append(env)
        return env

    yield make
    for env in made:
        env.close()


def walk(env, steps, action=RIGHT):
    """Return the rows of some equal steps."""
    return [env.step(np.full(env.num_envs, action)) for _ in range(steps)]


@pytest.mark.parametrize("members", [1, 3])
def test_a_step_has_a_row_for_each_member(make_env, make_member, members):
    """However many there are."""
    env = make_env(*(make_member(f"collect-{index}") for index in range(members)))

    first = env.reset()
    observations, rewards, dones, infos = env.step(np.full(members, RIGHT))

    assert isinstance(env, VecEnv)
    assert first.shape == observations.shape == (members, 2)
    assert rewards.dtype == np.float32
    assert rewards.shape == dones.shape == (members,)
    assert [info["valid"] for info in infos] == [True] * members


def test_an_episode_is_reset_in_its_last_step(make_env, make_member):
    """Stable-Baselines3 expects the next episode's first observation, and the last in info."""
    env = make_env(make_member())
    env.reset()

    observations, rewards, dones, infos = walk(env, 3)[-1]

    assert dones[0]
    assert observations[0][0] == 0.0
    assert infos[0]["terminal_observation"][0] == np.float32(0.3)
    assert infos[0]["TimeLimit.truncated"] is False
    assert infos[0]["episode"]["r"] == pytest.approx(0.8)
    assert infos[0]["episode"]["l"] == 3
    assert rewards[0] == 1.0


def test_a_time_limit_is_told_from_an_end(make_env, make_member):
    """The value of what would have come is bootstrapped after a limit only."""
    env = make_env(make_member())
    env.reset()

    _, _, dones, infos = walk(env, 8, LEFT)[-1]

    assert dones[0]
    assert infos[0]["TimeLimit.truncated"] is True


def test_each_episode_has_the_seed_of_its_number(make_env, make_member):
    """So a run can be told again, and resumed."""
    members = [make_member("collect-0"), make_member("collect-1")]
    env = make_env(*members, run_seed=5, episodes=[7, 0])

    env.reset()
    walk(env, 3)

    assert members[0].env.seeds == [episode_seed(5, COLLECT, 0, number) for number in (7, 8)]
    assert members[1].env.seeds == [episode_seed(5, COLLECT, 1, number) for number in (0, 1)]
    assert env.episodes == [9, 2]
    assert [info["seed"] for info in env.reset_infos] == [members[i].env.seeds[-1] for i in (0, 1)]


def test_a_fault_ends_the_episode_as_truncated_and_invalid(make_env, make_member):
    """Nobody did anything wrong: no reward, no punishment, no learning from it."""
    env = make_env(make_member(steps=[2]))
    env.reset()

    observations, rewards, dones, infos = walk(env, 2)[-1]

    assert dones[0]
    assert rewards[0] == 0.0
    assert observations[0][0] == 0.0
    assert infos[0]["valid"] is False
    assert infos[0]["TimeLimit.truncated"] is True
    assert infos[0]["terminal_observation"][0] == np.float32(0.1)
    assert infos[0]["sim_fault"]["kind"] == "dead"
    assert infos[0]["sim_fault"]["simulator"] == "collect-0"
    assert "episode" not in infos[0]


def test_a_fault_restarts_its_simulator_alone(make_env, make_member):
    """The others know nothing of it."""
    members = [make_member("collect-0"), make_member("collect-1", steps=[2]), make_member("collect-2")]
    env = make_env(*members)
    env.reset()

    _, _, dones, infos = walk(env, 2)[-1]

    assert [member.log for member in members] == [[], ["restart"], []]
    assert dones.tolist() == [False, True, False]
    assert [info["valid"] for info in infos] == [True, False, True]


def test_every_kind_of_fault_is_told_by_its_name(make_env, make_member):
    """A person who reads the counts looks for different causes."""
    faults = {1: SimulatorHung("x", "slow"), 2: WrongData("x", "NaN")}
    env = make_env(make_member(steps=faults))
    env.reset()

    rows = walk(env, 2)

    assert [infos[0]["sim_fault"]["kind"] for _, _, _, infos in rows] == ["hung", "wrong_data"]


def test_a_simulator_that_does_not_come_back_is_tried_again(make_env, make_member):
    """The first restart after an out-of-memory kill often fails as well."""
    member = make_member(steps=[1], starts=[1, 2], resets=[2])
    env = make_env(member)
    env.reset()

    walk(env, 2)

    assert member.log == ["restart"] * 4


def test_a_spent_budget_ends_the_run(make_env, make_member):
    """Restarting for ever would look like progress."""
    env = make_env(make_member(steps=range(1, 100)), care=Care(restart_limit=2))
    env.reset()

    with pytest.raises(FaultBudgetSpent, match=r"collect-0: 2 restarts within 600 s .* restart.limit"):
        walk(env, 3)


def test_a_budget_is_spent_within_its_window_only(make_member):
    """One fault an hour for a week is no reason to give up."""
    times = iter([0.0, 100.0, 600.0, 650.0])
    member = make_member(steps=range(1, 100))
    keeper = Keeper(member, Care(restart_limit=2, restart_within_s=600.0), clock=lambda: next(times))
    env = SimulatorsVecEnv([keeper], 1)
    env.reset()

    walk(env, 3)

    with pytest.raises(FaultBudgetSpent):
        walk(env, 1)


def test_a_member_is_recycled_between_episodes_without_a_fault(make_env, make_member):
    """Simulators leak; a restart in time costs less than a crash."""
    member = make_member()
    env = make_env(member, care=Care(recycle_after_resets=2))
    env.reset()

    rows = walk(env, 9)

    assert member.log == ["restart"]
    assert all(infos[0]["valid"] for _, _, _, infos in rows)
    assert member.resets == 2


def test_a_recycling_that_fails_is_a_fault_like_any_other(make_env, make_member):
    """It is mended, and the episode begins."""
    member = make_member(starts=[1])
    env = make_env(member, care=Care(recycle_after_resets=1))
    env.reset()

    walk(env, 3)

    assert member.log == ["restart", "restart"]


def test_an_error_that_is_no_fault_comes_out_when_all_rows_are_done(make_env, make_member):
    """Nothing is restarted when the ROS master is gone, and no member is left amid a step."""
    lost = MasterLost("gone")
    env = make_env(make_member("collect-0", steps={1: lost}), make_member("collect-1"))
    env.reset()

    with pytest.raises(MasterLost):
        walk(env, 1)


def test_members_step_at_the_same_time(make_env, make_member):
    """Four simulators must not take four times as long: all are asked before one is awaited."""
    members = [make_member(f"collect-{index}") for index in range(4)]
    told = []
    for member in members:

        def step(name=member.name):
            told.append(("asked", name))
            let_others()
            told.append(("awaited", name))

        member.take_step = step
    env = make_env(*members)
    env.reset()

    walk(env, 1)

    names = [member.name for member in members]
    assert told == [("asked", name) for name in names] + [("awaited", name) for name in names]


@pytest.mark.parametrize("members", [1, 2])
def test_resting_reaches_every_member(make_env, make_member, members):
    """Resting simulators leave the processor to whoever learns."""
    made = [make_member(f"collect-{index}") for index in range(members)]
    env = make_env(*made)

    env.pause()
    env.run()

    assert [member.log for member in made] == [["pause", "run"]] * members


def test_a_broken_member_is_left_for_the_next_step_to_find(make_env, make_member):
    """Resting is a kindness; failing at it is no reason to end a run."""
    member = make_member()
    member.pause = lambda: (_ for _ in ()).throw(SimulatorHung("collect-0", "no answer"))
    env = make_env(member)

    env.pause()

    assert env.reset().shape == (1, 2)


def test_the_rest_of_the_interface_reaches_the_environments(make_env, make_member):
    """Callbacks and wrappers of others use it."""
    members = [make_member("collect-0"), make_member("collect-1")]
    members[0].env = Wrapper(members[0].env)
    env = make_env(*members)
    env.set_options({"easy": True})
    env.reset()
    env.set_attr("colour", "red", indices=1)

    assert env.get_attr("options") == [{"easy": True}] * 2
    assert env.get_attr("colour", indices=[1]) == ["red"]
    assert env.env_method("has_wrapper_attr", "seeds", indices=0) == [True]
    assert env.env_is_wrapped(Wrapper) == [True, False]
    assert env.seed(9) == [episode_seed(9, COLLECT, index, 1) for index in (0, 1)]
    assert env.seed() == env.seed(9)


def test_observations_by_name_are_stacked_by_name(make_env, make_member):
    """Whoever has a camera has a Dict."""

    class Named(Wrapper):
        observation_space = spaces.Dict({"place": spaces.Box(-1.0, 1.0, (2,), np.float32)})

        def reset(self, **options):
            observation, info = super().reset(**options)
            return {"place": observation}, info

        def step(self, action):
            observation, *rest = super().step(action)
            return {"place": observation}, *rest

    members = [make_member("collect-0"), make_member("collect-1")]
    for member in members:
        member.env = Named(member.env)
    env = make_env(*members)

    assert env.reset()["place"].shape == (2, 2)
    assert walk(env, 1)[0][0]["place"].shape == (2, 2)
