"""One simulator as an environment for a training loop that does not handle faults."""

from __future__ import annotations

import threading

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_for_sb3

from palaestra_trainer.environments.make import make_environment
from palaestra_trainer.errors import Diverged, FaultBudgetSpent, SimulatorHung, WrongData
from palaestra_trainer.job.configuration import Environment
from palaestra_trainer.run.fault_tolerant.env import FaultTolerantEnv
from palaestra_trainer.testing import fake_arena

RIGHT, LEFT = 1, 0


@pytest.fixture
def make_env(make_players, make_member):
    """Return a function that makes an environment and its simulator.

    The keywords set the simulator's faults.
    """

    def make(*, restarts=10, deadline_s=20.0, wait_for_restart=False, **faults):
        member = make_member(**faults)
        players = make_players(
            member, restarts=restarts, deadline_s=deadline_s, wait_for_restart=wait_for_restart
        )
        return FaultTolerantEnv(players), member

    return make


def test_a_healthy_episode_is_that_of_the_environment(make_env):
    """Without faults, a loop must see the same values as with the environment alone."""
    env, member = make_env()

    first, info = env.reset(seed=7)
    steps = [env.step(RIGHT) for _ in range(3)]

    assert first.tolist() == pytest.approx([0.0, 0.7])
    assert info == {"seed": 7}
    assert [step[1] for step in steps] == [-0.1, -0.1, 1.0]
    assert [step[2:4] for step in steps] == [(False, False), (False, False), (True, False)]
    assert steps[-1][4]["is_success"]
    assert env.observation_space is member.env.observation_space


def test_a_fault_returns_the_last_observation_as_truncated(make_env):
    """A loop must learn only from values that a simulator has sent."""
    env, _ = make_env(steps=[2])
    env.reset(seed=7)
    before = env.step(RIGHT)[0]

    observation, reward, terminated, truncated, info = env.step(RIGHT)

    assert observation.tolist() == before.tolist()
    assert (reward, terminated, truncated) == (0.0, False, True)
    assert {name: info["palaestra"]["sim_fault"][name] for name in ("kind", "simulator", "step")} == {
        "kind": "dead",
        "simulator": "collect-0",
        "step": 1,
    }


def test_an_observation_that_the_environment_reuses_is_not_that_of_the_broken_step(make_env):
    """An image may be a view of a buffer that an interrupted step has partly overwritten."""
    env, member = make_env(steps=[2])
    seen = np.zeros(2, np.float32)
    member.env._observe = lambda: seen
    env.reset()
    seen[:] = 0.5
    env.step(RIGHT)
    seen[:] = 9.0

    assert env.step(RIGHT)[0].tolist() == [0.5, 0.5]


def test_the_reset_after_a_fault_waits_until_the_simulator_is_mended(make_env):
    """The loop itself then needs no code for restarts."""
    env, member = make_env(steps=[1], held=True)
    env.reset(seed=1)
    env.step(RIGHT)
    threading.Timer(0.05, member.release.set).start()

    observation, _ = env.reset(seed=2)

    assert member.log == ["restart"]
    assert observation.tolist() == pytest.approx([0.0, 0.2])


def test_a_fault_in_a_reset_begins_the_same_episode_again(make_env):
    """The seed determines the episode, however often the simulator breaks."""
    env, member = make_env(resets=[1, 2])

    observation, _ = env.reset(seed=5)

    assert observation.tolist() == pytest.approx([0.0, 0.5])
    assert member.env.seeds == [5]
    assert member.log == ["restart", "restart"]


def test_without_a_seed_the_episodes_are_those_of_the_last_seed(make_env):
    """As in gymnasium, later episodes follow from the last seed.

    The environment of a standby has another generator, so the wrapper itself draws the seeds.
    """
    env, member = make_env()
    for seed in (3, None, None, 3, None, None):
        env.reset(seed=seed)

    first, second = member.env.seeds[:3], member.env.seeds[3:]
    assert first == second
    assert len(set(first)) == 3


def test_a_step_without_an_episode_is_a_mistake(make_env):
    """A step after the end of an episode is a mistake too, even if a fault ended it."""
    env, _ = make_env(steps=[1])
    with pytest.raises(ResetNeeded, match="call reset"):
        env.step(RIGHT)
    env.reset()
    env.step(RIGHT)

    with pytest.raises(ResetNeeded, match="call reset"):
        env.step(RIGHT)


def test_a_step_that_is_interrupted_ends_the_episode(make_env):
    """After Ctrl-C in a notebook, a response is still unread, and the next step would read it as its own."""
    env, member = make_env()
    env.reset()

    def interrupted():
        raise KeyboardInterrupt

    take_step, member.take_step = member.take_step, interrupted
    with pytest.raises(KeyboardInterrupt):
        env.step(RIGHT)
    member.take_step = take_step

    with pytest.raises(ResetNeeded):
        env.step(RIGHT)
    env.reset()
    env.step(RIGHT)


def test_a_simulator_that_breaks_too_often_ends_with_a_typed_error(make_env):
    """Each further reset raises the error too, instead of restarting the simulator endlessly."""
    env, _ = make_env(restarts=1, resets=range(1, 10))

    for _ in range(2):
        with pytest.raises(FaultBudgetSpent, match="collect-0"):
            env.reset()


def test_a_simulator_that_is_not_mended_in_time_ends_with_a_typed_error(make_env):
    """The budget counts restarts, so a restart that never ends does not spend it."""
    env, _ = make_env(deadline_s=0.0, resets=[1], held=True)

    with pytest.raises(SimulatorHung, match="not restarted within 0 s"):
        env.reset()


def test_a_number_that_is_not_finite_is_no_fault(make_env):
    """The environment caused it, and a restart would hide the mistake."""
    env, member = make_env()
    env.reset()
    member.env.step_reward = float("nan")

    with pytest.raises(Diverged, match="the reward is nan"):
        env.step(RIGHT)


def test_a_step_can_wait_for_the_mending_itself(make_env):
    """A program that pauses its simulator after each step must not pause it during a restart."""
    env, member = make_env(wait_for_restart=True, steps={1: WrongData("collect-0", "nonsense")})
    env.reset()

    assert env.step(RIGHT)[4]["palaestra"]["sim_fault"]["kind"] == "wrong_data"
    assert member.log == ["restart"]


def test_a_simulator_is_recycled_in_a_reset(make_env):
    """As in the built-in training loop, recycling happens between episodes and is no fault."""
    env, member = make_env(recycle_after=2)

    for seed in range(3):
        env.reset(seed=seed)

    assert member.log == ["restart"]
    assert member.env.seeds == [0, 1, 2]


def test_an_environment_is_closed_once(make_players, make_member):
    """`close` and the end of the process may each try to close the environment."""
    players = make_players(make_member())
    env = FaultTolerantEnv(players)

    env.close()
    env.close()

    assert players.released == [1]


class Seated:
    """A simulator with an environment on the fake arena."""

    name = "collect-0"

    def __init__(self, deaths=(), environment="MoveToTargetEnv-v0"):
        self.robot, self.scene = fake_arena(deaths)
        self.env = make_environment(Environment(id=environment), self.robot, self.scene)

    def due(self, episodes=1):
        """Return None, because this simulator is never recycled."""

    def restart(self):
        """Restart the fake robot."""
        self.robot.restart()

    def stop(self):
        """Do nothing, because the fake robot has no process."""

    abandon = pause = unpause = start = stop


class Painted(gymnasium.Env):
    """A user's environment with its own attributes and a method."""

    observation_space = gymnasium.spaces.Discrete(2)
    action_space = gymnasium.spaces.Discrete(2)
    color = "red"

    def __init__(self, robot, scene):
        self.robot, self.scene = robot, scene

    def reset(self, *, seed=None, options=None):
        """Return an observation."""
        del options
        super().reset(seed=seed)
        return 0, {}

    def step(self, action):
        """Return the color in the info."""
        del action
        return 0, 0.0, False, False, {"color": self.color}

    def paint(self, color):
        """Change the color."""
        self.color = color
        return f"painted {color}"


gymnasium.register("Painted-v0", Painted)


def seen_from_outside(env):
    """Return what a program reads from an environment, writes into it, and gets from its method."""
    env.reset(seed=4)
    painted = env.get_wrapper_attr("paint")("blue")
    after_painting = env.step(0)[4]
    set_ = env.set_wrapper_attr("color", "green")
    unknown = [env.has_wrapper_attr("price"), env.set_wrapper_attr("price", 3, force=False)]
    with pytest.raises(AttributeError, match="price"):
        env.get_wrapper_attr("price")
    return {
        "kind": type(env.unwrapped),
        "robot": env.unwrapped.robot is env.get_wrapper_attr("robot"),
        "colors": [painted, after_painting, set_, env.step(0)[4], env.unwrapped.color],
        "unknown": [*unknown, env.set_wrapper_attr("price", 5), env.get_wrapper_attr("price")],
        "on the environment": hasattr(env.unwrapped, "price"),
        "outside": hasattr(env, "robot"),
        "random": [env.np_random is env.unwrapped.np_random, env.np_random_seed],
    }


def test_attributes_and_methods_of_an_environment_are_reached_as_through_gymnasium_s_wrappers(make_players):
    """A program that was written for `gymnasium.make` must work with `make_env`."""
    member = Seated(environment="Painted-v0")
    plain = gymnasium.make("Painted-v0", robot=member.robot, scene=member.scene)

    ours = seen_from_outside(FaultTolerantEnv(make_players(member)))

    assert ours == seen_from_outside(plain)
    assert ours["robot"]
    assert ours["colors"] == ["painted blue", {"color": "blue"}, True, {"color": "green"}, "green"]


def test_a_standby_that_takes_over_has_the_attributes_that_were_set(make_players):
    """The standby has another environment object, which the wrapper uses from the next episode on."""
    member = Seated(environment="Painted-v0")
    env = FaultTolerantEnv(make_players(member))
    env.reset()
    env.set_wrapper_attr("color", "green")
    member.env = Seated(environment="Painted-v0").env

    env.reset()

    assert env.unwrapped is member.env.unwrapped
    assert env.unwrapped.color == "green"


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version")
@pytest.mark.parametrize("check", [check_env, check_env_for_sb3], ids=["gymnasium", "sb3"])
def test_the_checkers_of_other_projects_have_nothing_to_object_to(make_players, check):
    """The checkers test seeds, spaces, types and determinism; each warning is an error here."""
    check(FaultTolerantEnv(make_players(Seated())), skip_render_check=True)


def test_common_wrappers_can_be_put_around_it(make_players):
    """The wrappers read spaces and metadata, and pass a fault on."""
    env = gymnasium.wrappers.RecordEpisodeStatistics(
        gymnasium.wrappers.TimeLimit(FaultTolerantEnv(make_players(Seated(deaths=[4]))), 10)
    )
    env.reset(seed=1)
    steps = [env.step(0) for _ in range(4)]

    assert steps[-1][3]
    assert steps[-1][4]["episode"]["l"] == 4
    assert steps[-1][4]["palaestra"]["sim_fault"]["kind"] == "dead"
