"""The task MoveToTarget: how an episode begins, proceeds and ends."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.environments import MoveToTargetEnv
from palaestra_trainer.environments.move_to_target import REACHED_M, STANDING_M_S
from palaestra_trainer.errors import ConfigurationError, SimulatorDead
from palaestra_trainer.robots import Movement, Pose
from palaestra_trainer.testing import FakeRobotino, FakeScene, fake_arena

STOP, FORWARD, BACKWARD = Movement.STOP, Movement.FORWARD, Movement.BACKWARD
BESIDE_THE_TARGET = {"start": (0.0, 0.0, 0.0), "target": (0.25, 0.0)}
BEFORE_A_WALL = {"start": (1.6, 0.0, 0.0), "target": (-1.0, 0.0)}
IN_THE_OPEN = {"start": (0.0, 0.0, 0.0), "target": (1.5, 0.0)}


def play(env: MoveToTargetEnv, episode, movements):
    """Return the results of the steps of one episode."""
    env.reset(seed=3, options=episode)
    return [env.step(movement) for movement in movements]


def test_the_robot_has_to_stand_on_the_target_not_to_cross_it(make_env):
    """The robot must be within 0.20 m and slower than 0.05 m/s, so it needs a step of STOP."""
    env = make_env()

    steps = play(env, BESIDE_THE_TARGET, [FORWARD, FORWARD, STOP])

    assert env.situation.target_distance_m < REACHED_M
    assert env.situation.speed_m_s < STANDING_M_S
    assert [info["outcome"] for *_, info in steps] == ["running"] * 2 + ["reached"]
    assert [info["is_success"] for *_, info in steps] == [False] * 2 + [True]
    assert steps[-1][2:4] == (True, False)


def test_standing_beside_the_target_is_not_enough(make_env):
    """A distance of 0.25 m is outside the radius of 0.20 m."""
    steps = play(make_env(), BESIDE_THE_TARGET, [STOP, STOP])

    assert [terminated for _, _, terminated, _, _ in steps] == [False, False]


def test_a_collision_ends_the_episode(make_env):
    """A robot must not learn to drive along a wall by touching it."""
    env = make_env()
    env.reset(seed=3, options=BEFORE_A_WALL)

    ends = iter(lambda: env.step(FORWARD), None)
    _, reward, terminated, truncated, info = next(it for it in ends if it[2] or it[3])

    assert (terminated, truncated) == (True, False)
    assert info["outcome"] == "collided"
    assert not info["is_success"]
    assert reward < 0.0


TERMINATED, TRUNCATED = (True, False), (False, True)


@pytest.mark.parametrize(
    ("options", "end"),
    [
        ({"reward": "Dense"}, TRUNCATED),
        ({"reward": "Dense", "time_up": "terminated"}, TERMINATED),
        ({"reward": "Sparse"}, TERMINATED),
        ({"reward": "Sparse", "time_up": "truncated"}, TRUNCATED),
    ],
)
def test_time_is_up_after_max_steps_and_ends_the_episode_as_the_option_or_else_the_reward_says(
    make_env, options, end
):
    """With Sparse, running out of time has a cost.

    If the episode were truncated, the learner would add the estimated value of later steps to this cost.
    """
    steps = play(make_env(max_steps=3, **options), IN_THE_OPEN, [STOP] * 3)

    assert [step[2:4] for step in steps] == [(False, False), (False, False), end]
    assert steps[-1][4]["outcome"] == "time_up"
    assert [step[0][-1] for step in steps] == pytest.approx([2 / 3, 1 / 3, 0.0], abs=1e-6)


def test_reaching_the_target_with_the_last_step_counts(make_env):
    """The time limit includes the last step."""
    steps = play(make_env(max_steps=3), BESIDE_THE_TARGET, [FORWARD, FORWARD, STOP])

    assert steps[-1][4]["is_success"]
    assert steps[-1][2:4] == (True, False)


def test_the_reward_is_the_sum_of_the_terms_it_names(make_env):
    """TensorBoard shows each term by its name, so the terms must add up to the reward."""
    for _, reward, _, _, info in play(make_env(), BESIDE_THE_TARGET, [FORWARD, FORWARD, STOP]):
        assert reward == pytest.approx(sum(info["reward_terms"].values()))


def test_dense_pays_for_progress_and_sparse_does_not(make_env):
    """Dense guides the policy on its way to the target; Sparse pays only at the end."""
    rewards = {
        name: play(make_env(reward=name), IN_THE_OPEN, [FORWARD, FORWARD])[-1][1]
        for name in ("Dense", "Sparse")
    }

    assert rewards["Dense"] > 0.0
    assert rewards["Sparse"] == 0.0


@given(seed=st.integers(0, 2**31 - 1))
def test_a_seed_decides_the_whole_episode(seed):
    """An evaluation repeats an episode after a fault, and two simulators may play the same episode."""
    one, other = MoveToTargetEnv(*fake_arena()), MoveToTargetEnv(*fake_arena())
    other.reset(seed=1)
    other.step(FORWARD)
    seen = [env.reset(seed=seed) for env in (one, other)]
    after = [env.step(FORWARD)[0] for env in (one, other)]

    assert seen[0][1] == seen[1][1]
    assert np.array_equal(seen[0][0], seen[1][0])
    assert np.array_equal(after[0], after[1])


def test_without_a_seed_the_next_episode_is_another_one(make_env):
    """As in gymnasium, the first seed also determines the later episodes."""
    runs = []
    for _ in range(2):
        env = make_env()
        env.reset(seed=5)
        runs.append([env.reset()[1]["target"] for _ in range(4)])

    assert len(set(runs[0])) == 4
    assert runs[0] == runs[1]


def test_start_and_target_can_be_chosen(make_env):
    """A person chooses both for a demonstration, a regression test, or one failing case."""
    env = make_env()

    observation, info = env.reset(options={"start": (0.0, -1.0, math.pi / 2), "target": (0.0, 1.0)})

    assert info == {"start": Pose(0.0, -1.0, math.pi / 2), "target": (0.0, 1.0)}
    assert observation.shape == env.observation_space.shape
    assert env.situation.target_ahead == pytest.approx((2.0, 0.0))


def test_an_impossible_start_is_refused(make_env):
    """A robot that starts inside a cylinder could not move."""
    with pytest.raises(ConfigurationError, match="start"):
        make_env().reset(options={"start": (0.8, 0.8, 0.0)})


def test_an_episode_begins_at_rest_after_one_that_was_cut_short(make_env):
    """The robot's old velocity must not appear in the first observation."""
    env = make_env()
    play(env, IN_THE_OPEN, [FORWARD] * 3)

    env.reset(options=IN_THE_OPEN)
    at_start = env.situation
    env.step(STOP)

    assert at_start.velocity == (0.0, 0.0, 0.0)
    assert env.situation.pose == at_start.pose


def test_movements_are_the_ones_that_were_chosen(make_env):
    """Action 1 is the second movement of the option, whatever its number in the enumeration."""
    env = make_env(movements=["STOP", "BACKWARD"])

    play(env, IN_THE_OPEN, [1, 1])

    assert env.action_space.n == 2
    assert env.situation.velocity[0] < 0.0


def test_a_continuous_action_is_a_share_of_the_greatest_velocity(make_env):
    """The example is half of 0.5 m/s to the left. Values beyond the bounds are clipped."""
    env = make_env(actions="continuous")

    play(env, IN_THE_OPEN, [np.array([0.0, 0.5, 0.0])] * 2)
    half = env.situation.velocity
    play(env, IN_THE_OPEN, [np.array([9.0, 0.0, 0.0])] * 2)

    assert half == pytest.approx((0.0, 0.25, 0.0), abs=1e-6)
    assert env.situation.velocity == pytest.approx((0.5, 0.0, 0.0), abs=1e-6)


class _Late(FakeRobotino):
    """A robot whose sensor is late in each step."""

    def advance(self) -> int:
        super().advance()
        super().advance()
        return 1


def test_extra_steps_are_reported_and_not_taken_for_speed():
    """A late sensor costs one more control period. The robot drove for longer, and not twice as fast."""
    robot = _Late()
    env = MoveToTargetEnv(robot, FakeScene(robot))

    *_, info = play(env, IN_THE_OPEN, [FORWARD, FORWARD])[-1]

    assert info["palaestra"]["extra_steps"] == 1
    assert env.situation.speed_m_s == pytest.approx(0.5, abs=0.01)


def test_a_fault_of_the_simulator_passes_through(make_env):
    """Only the caller of the environment can decide what a fault means for learning."""
    env = make_env(deaths=(2,))
    env.reset(seed=0)
    env.step(STOP)

    with pytest.raises(SimulatorDead):
        env.step(STOP)
    with pytest.raises(SimulatorDead):
        env.reset(seed=0)


def test_a_step_before_the_first_reset_is_refused(make_env):
    """Gymnasium raises this error, which its users know."""
    with pytest.raises(ResetNeeded, match=r"call reset\(\) first"):
        make_env().step(STOP)


@given(seed=st.integers(0, 2**31 - 1), actions=st.lists(st.integers(0, 6), max_size=30))
def test_every_observation_is_in_the_space_and_every_reward_is_finite(seed, actions):
    """An observation outside the space or an infinite reward would end a training."""
    env = MoveToTargetEnv(*fake_arena())
    observation, _ = env.reset(seed=seed)

    for action in actions:
        assert env.observation_space.contains(observation)
        observation, reward, terminated, truncated, _ = env.step(action)
        assert math.isfinite(reward)
        if terminated or truncated:
            break

    assert env.observation_space.contains(observation)
