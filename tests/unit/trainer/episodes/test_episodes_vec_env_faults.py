"""A fault of a simulator ends its episode, and the other simulators of a VecEnv continue meanwhile."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest
from gymnasium import Wrapper

from palaestra_trainer.episodes.episode_state import EpisodeState
from palaestra_trainer.episodes.seeds import COLLECT, episode_seed
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import Diverged, FaultBudgetSpent, MasterLost, SimulatorHung, WrongData
from palaestra_trainer.run.signals import Interrupted
from palaestra_trainer.simulators.budget import Group, RestartLimit
from palaestra_trainer.simulators.restarter import Restarter
from tests.unit.trainer.episodes.walking import LEFT, RIGHT, end_of_restart, walk


def test_a_fault_ends_the_episode_as_truncated_and_invalid(make_vec_env, make_member):
    """The policy did not cause the fault.

    So the policy gets no reward and no penalty, and does not learn from the row.
    """
    env = make_vec_env(make_member(steps=[2]))
    env.reset()

    observations, rewards, dones, infos = walk(env, 2)[-1]

    assert dones[0]
    assert rewards[0] == 0.0
    assert observations[0][0] == np.float32(0.1)
    assert infos[0]["palaestra"]["valid"] is False
    assert infos[0]["TimeLimit.truncated"] is True
    assert infos[0]["terminal_observation"][0] == np.float32(0.1)
    assert infos[0]["palaestra"]["sim_fault"]["kind"] == "dead"
    assert infos[0]["palaestra"]["sim_fault"]["simulator"] == "collect-0"
    assert infos[0]["palaestra"]["sim_fault"]["step"] == 1
    assert "recovering" not in infos[0]["palaestra"]
    assert "episode" not in infos[0]


def test_alone_the_step_after_a_fault_waits_and_begins_the_next_episode(make_vec_env, make_member):
    """No other simulator can step meanwhile, and nothing is learned from this row."""
    member = make_member(steps=[2], held=True)
    env = make_vec_env(member)
    env.reset()
    walk(env, 2)
    threading.Timer(0.05, member.release.set).start()

    observations, rewards, dones, infos = walk(env, 1)[0]

    assert member.log == ["restart"]
    assert (dones[0], rewards[0], observations[0][0]) == (True, 0.0, 0.0)
    assert (infos[0]["palaestra"]["valid"], infos[0]["palaestra"]["recovering"]) == (False, True)
    assert "sim_fault" not in infos[0]["palaestra"]
    assert walk(env, 1)[0][3][0]["palaestra"]["valid"] is True


def test_nobody_waits_for_a_member_that_is_restarted(make_vec_env, make_member):
    """The other simulators continue.

    The rows of the broken one are invalid, and do not end or begin an episode.
    """
    members = [make_member("collect-0"), make_member("collect-1", steps=[2], held=True)]
    env = make_vec_env(*members)
    env.reset()
    walk(env, 2)

    rows = walk(env, 20, LEFT)

    assert all(infos[0]["palaestra"]["valid"] for _, _, _, infos in rows)
    assert not any(infos[1]["palaestra"]["valid"] for _, _, _, infos in rows)
    assert all(infos[1]["palaestra"]["recovering"] for _, _, _, infos in rows)
    assert not any(dones[1] for _, _, dones, _ in rows)
    assert not any("sim_fault" in infos[1]["palaestra"] for _, _, _, infos in rows)
    assert [members[0].log, members[1].log] == [[], ["restart"]]


def test_a_restarted_member_begins_its_next_episode(make_vec_env, make_member):
    """The episode has the next seed. One more invalid row ends the previous episode."""
    members = [make_member("collect-0"), make_member("collect-1", steps=[2], held=True)]
    env = make_vec_env(*members)
    env.reset()
    walk(env, 3)
    members[1].release.set()
    end_of_restart("collect-1")

    observations, _, dones, infos = walk(env, 1)[0]

    assert dones[1]
    assert infos[1]["palaestra"]["valid"] is False
    assert observations[1][0] == 0.0
    assert env.reset_infos[1]["seed"] == members[1].env.seeds[-1] == episode_seed(1, COLLECT, 1, 1)
    assert walk(env, 1)[0][3][1]["palaestra"]["valid"] is True


def test_while_all_are_restarted_a_step_waits_for_the_first(make_vec_env, make_member):
    """Rows that are all invalid would only use the processor."""
    members = [make_member(f"collect-{index}", steps=[1], held=True) for index in range(2)]
    looks = []

    def check():
        looks.append(1)
        if len(looks) == 3:
            members[1].release.set()

    env = make_vec_env(*members, check=check)
    env.reset()
    walk(env, 1)

    _, _, dones, infos = walk(env, 1)[0]

    assert len(looks) >= 3
    assert dones.tolist() == [False, True]
    assert [info["palaestra"]["valid"] for info in infos] == [False, False]
    assert [info["palaestra"]["valid"] for info in walk(env, 1)[0][3]] == [False, True]


def test_a_signal_does_not_wait_for_a_member_that_is_restarted(make_vec_env, make_member):
    """A simulator may take a minute to start, but an evicted pod has half a minute."""

    def check():
        raise Interrupted("SIGTERM received")

    env = make_vec_env(make_member(steps=[1], held=True), check=check)
    env.reset()
    walk(env, 1)

    with pytest.raises(Interrupted):
        walk(env, 1)


def test_a_fault_at_a_reset_does_not_spoil_the_step_before(make_vec_env, make_member):
    """The first episode ended normally. The fault belongs to the next episode, before its first step."""
    env = make_vec_env(make_member(resets=[2]))
    env.reset()

    rows = walk(env, 5)

    assert [infos[0]["palaestra"]["valid"] for _, _, _, infos in rows] == [True, True, True, False, True]
    assert "sim_fault" not in rows[2][3][0]["palaestra"]
    assert rows[2][0][0][0] == np.float32(0.3)
    assert rows[3][3][0]["palaestra"]["sim_fault"]["step"] == 0
    assert rows[3][2][0]


def test_before_anything_was_seen_there_is_an_observation_of_nothing(make_vec_env, make_member):
    """The first reset may fail, but the row still needs an observation of the right shape."""
    env = make_vec_env(make_member(resets=[1]))

    first = env.reset()

    assert first.tolist() == [[0.0, 0.0]]
    assert walk(env, 2)[-1][3][0]["palaestra"]["valid"] is True


def test_a_reset_leaves_a_member_alone_that_is_restarted(make_vec_env, make_member):
    """REINFORCE resets all simulators, but only the restarter's thread may use a broken one."""
    members = [make_member("collect-0"), make_member("collect-1", steps=[2], held=True)]
    env = make_vec_env(*members)
    env.reset()
    walk(env, 2)

    observations = env.reset()

    assert observations[:, 0].tolist() == [0.0, np.float32(0.1)]
    assert [len(member.env.seeds) for member in members] == [2, 1]


def test_a_snapshot_has_no_episode_of_a_member_that_is_restarted(make_vec_env, make_member):
    """The steps of the cut episode are lost, so a resumed run begins the simulator's next episode."""
    members = [make_member("collect-0"), make_member("collect-1", steps=[2], held=True)]
    env = make_vec_env(*members)
    env.reset()
    walk(env, 2)

    states = env.snapshot()

    assert [state.episode for state in states] == [0, 1]
    assert states[0].actions.tolist() == [RIGHT, RIGHT]
    assert states[1].actions is None


def test_a_member_that_breaks_while_it_is_resumed_begins_the_next_episode(make_vec_env, make_member):
    """The resume is then not exact for this simulator, but the run continues."""
    env = make_vec_env(make_member(steps=[2]))

    env.resume([EpisodeState(4, np.array([LEFT, LEFT, LEFT]))])

    assert [(state.episode, state.actions) for state in env.snapshot()] == [(5, None)]
    _, _, dones, infos = walk(env, 1)[0]
    assert dones[0]
    assert infos[0]["palaestra"]["sim_fault"]["episode"] == 4
    assert env.snapshot()[0].episode == 5


def test_every_kind_of_fault_is_reported_by_its_name_and_once(make_vec_env, make_member):
    """A person who reads the counts looks for a different cause for each type."""
    faults = {1: SimulatorHung("x", "slow"), 2: WrongData("x", "NaN")}
    env = make_vec_env(make_member(steps=faults))
    env.reset()

    rows = walk(env, 5)

    told = [infos[0]["palaestra"].get("sim_fault", {}).get("kind") for _, _, _, infos in rows]
    assert told == ["hung", None, "wrong_data", None, None]


def test_an_observation_that_is_no_number_is_the_environment_s_mistake(make_vec_env, make_member):
    """The robot has checked its sensors, so NaN comes from the environment, and a restart would not help."""
    member = make_member()
    member.env = Wrapper(member.env)
    env = make_vec_env(member)
    env.reset()
    step = member.env.env.step
    member.env.step = lambda action: (np.array([0.0, np.nan], np.float32), *step(action)[1:])

    with pytest.raises(Diverged) as refusal:
        walk(env, 1)

    place = "episode 0, step 1: collect-0: environment Corridor: observation[1] is nan"
    assert str(refusal.value) == f"{place}; fix the environment"


def test_an_observation_of_a_reset_that_is_no_number_is_the_environment_s_mistake(make_vec_env, make_member):
    """The message has the number of the episode, so that the author can repeat it."""
    member = make_member()
    member.env._observe = lambda: {"wheels": np.array([[0.0], [math.inf]])}
    env = make_vec_env(member)

    with pytest.raises(Diverged, match=r"episode 0, reset: .* observation wheels\[1, 0\] is inf"):
        env.reset()


def test_a_sensor_that_is_no_number_is_the_simulator_s_fault(make_vec_env, make_member):
    """The robot raises the error, and a restart of the simulator may help."""
    env = make_vec_env(make_member(steps={1: WrongData("ir1", "nan from ir1")}))
    env.reset()

    _, _, _, infos = walk(env, 1)[0]

    assert infos[0]["palaestra"]["sim_fault"]["kind"] == "wrong_data"


def test_a_reward_that_is_no_number_is_nobody_s_fault_but_the_environment_s(make_vec_env, make_member):
    """A restart would not help, so the run ends, and the message has the reward term."""
    member = make_member()
    member.env.step_reward = math.inf
    env = make_vec_env(member)
    env.reset()

    with pytest.raises(Diverged) as refusal:
        walk(env, 1)

    fact = "episode 0, step 1: collect-0: environment Corridor: the reward is inf (term walk)"
    assert str(refusal.value) == f"{fact}; fix the environment's reward"


def test_a_simulator_that_does_not_come_back_is_tried_again(make_vec_env, make_member):
    """After a simulator ran out of memory, its first restart often fails as well."""
    member = make_member(steps=[1], starts=[1, 2], resets=[2])
    env = make_vec_env(member)
    env.reset()

    rows = walk(env, 4)

    assert member.log == ["restart"] * 4
    assert [infos[0]["palaestra"]["valid"] for _, _, _, infos in rows] == [False, False, False, True]


def test_a_spent_budget_ends_the_run(make_vec_env, make_member):
    """Endless restarts would look like progress."""
    env = make_vec_env(make_member(steps=range(1, 100)), limit=RestartLimit(restarts=2))
    env.reset()

    with pytest.raises(FaultBudgetSpent, match=r"^collect-0: 2 restarts within 600 s .* restart.limit"):
        walk(env, 6)


def test_a_budget_is_spent_within_its_window_only(make_member):
    """One fault an hour for a week does not spend the budget."""
    times = iter([0.0, 100.0, 600.0, 650.0])
    member = make_member(steps=range(1, 100))
    restarter = Restarter(member, RestartLimit(restarts=2, within_s=600.0), clock=lambda: next(times))
    env = SimulatorsVecEnv([restarter], 1)
    env.reset()

    walk(env, 6)

    with pytest.raises(FaultBudgetSpent):
        walk(env, 2)


def test_the_run_goes_on_without_a_simulator_if_enough_are_left(make_member):
    """Three of four simulators learn as much, but slower. With fewer than needed, the run ends."""
    group = Group(3, least=2)
    members = [
        make_member("collect-0", steps=range(1, 100)),
        make_member("collect-1"),
        make_member("collect-2", steps=range(40, 100)),
    ]
    restarters = [Restarter(member, RestartLimit(restarts=1), group=group) for member in members]
    env = SimulatorsVecEnv(restarters, 1)
    env.reset()
    for steps in (1, 2):
        walk(env, steps)
        end_of_restart("collect-0")

    rows = walk(env, 30)

    assert restarters[0].lost
    assert members[0].log == ["restart", "stop"]
    assert all(infos[1]["palaestra"]["valid"] and infos[2]["palaestra"]["valid"] for _, _, _, infos in rows)
    assert not any(dones[0] or infos[0]["palaestra"]["valid"] for _, _, dones, infos in rows)
    with pytest.raises(FaultBudgetSpent, match="collect-2: 1 restarts"):
        walk(env, 500)


def test_an_error_that_is_no_fault_comes_out_when_all_rows_are_done(make_vec_env, make_member):
    """Without a ROS master nothing can be restarted, and no simulator may be left in the middle of a step."""
    lost = MasterLost("gone")
    env = make_vec_env(make_member("collect-0", steps={1: lost}), make_member("collect-1"))
    env.reset()

    with pytest.raises(MasterLost):
        walk(env, 1)
