"""The vector environments for Stable-Baselines3 have the interface of Stable-Baselines3's own."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.vector import SyncVectorEnv
from gymnasium.wrappers import TimeLimit
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv

from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.run.fault_tolerant.env_group import EnvGroup
from palaestra_trainer.run.fault_tolerant.sb3_vec_env import FaultTolerantVecEnv
from palaestra_trainer.run.fault_tolerant.vector_env import FaultTolerantVectorEnv
from palaestra_trainer.simulators.restarter import Restarter

MEMBERS = 3
PICTURE = np.full((4, 6, 3), 7, np.uint8)


class Slope(gymnasium.Env):
    """An environment that returns its level in the info; a curriculum may raise the level."""

    metadata = {"render_modes": ["rgb_array"]}  # noqa: RUF012 - as in each environment
    observation_space = spaces.Box(-1, 1, (1,), np.float32)
    action_space = spaces.Discrete(2)
    level = 0

    def __init__(self, render_mode=None):
        self.render_mode = render_mode
        self.options = None

    def reset(self, *, seed=None, options=None):
        """Begin an episode."""
        super().reset(seed=seed)
        self.options = options
        return np.zeros(1, np.float32), {"level": self.level}

    def step(self, action):
        """Take a step."""
        del action
        return np.zeros(1, np.float32), 0.0, False, False, {"level": self.level}

    def render(self):
        """Return an image."""
        return PICTURE

    def twice(self, number):
        """Return twice the number."""
        return 2 * number


def wrapped(render_mode=None):
    """Return the environment inside a wrapper."""
    return TimeLimit(Slope(render_mode), 50)


@pytest.fixture
def restarters(make_member):
    """Return a function that makes restarters of simulators with the environment."""

    def make(render_mode=None):
        members = [make_member(f"collect-{index}") for index in range(MEMBERS)]
        for member in members:
            member.env = wrapped(render_mode)
        return [Restarter(member) for member in members]

    return make


VECTORS = {
    "of a run": lambda restarters: SimulatorsVecEnv(restarters, 1),
    "tolerant": lambda restarters: FaultTolerantVecEnv(EnvGroup(restarters, lambda: None)),
}
CALLS = {
    "an attribute of the environment": lambda env: env.get_attr("level"),
    "an attribute of a wrapper": lambda env: env.get_attr("_max_episode_steps"),
    "chosen ones": lambda env: env.get_attr("level", [0, 2]),
    "whether there is an attribute": lambda env: (env.has_attr("level"), env.has_attr("nothing")),
    "a method": lambda env: env.env_method("twice", 3, indices=[1]),
    "a wrapper": lambda env: env.env_is_wrapped(TimeLimit),
    "no such wrapper": lambda env: env.env_is_wrapped(gymnasium.wrappers.ClipAction, 0),
    "the number of seeds": lambda env: len(env.seed(5)),
}


@pytest.fixture(scope="module", params=["in this process", "in processes"])
def reference(request):
    """Yield a vector environment of Stable-Baselines3."""
    if request.param == "in this process":
        env = DummyVecEnv([wrapped] * MEMBERS)
    else:
        env = SubprocVecEnv([wrapped] * MEMBERS, start_method="fork")  # only a fork need not import PyTorch
    yield env
    env.close()


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
@pytest.mark.parametrize("make", VECTORS.values(), ids=VECTORS)
def test_a_vector_answers_as_those_of_stable_baselines3(restarters, make, call, reference):
    """Callbacks of other projects are written for Stable-Baselines3's vectors."""
    assert call(make(restarters())) == call(reference)


@pytest.mark.parametrize("render_mode", [None, "rgb_array"])
@pytest.mark.parametrize("make", VECTORS.values(), ids=VECTORS)
@pytest.mark.filterwarnings("ignore:.*render:UserWarning")
def test_a_vector_draws_as_that_of_stable_baselines3(restarters, make, render_mode):
    """A video recorder for Stable-Baselines3 gets one image of all environments, or None without a mode."""
    env, reference = make(restarters(render_mode)), DummyVecEnv([lambda: wrapped(render_mode)] * MEMBERS)

    assert np.array_equal(env.get_images(), reference.get_images())
    assert np.array_equal(env.render(), reference.render())


@pytest.mark.parametrize("make", VECTORS.values(), ids=VECTORS)
def test_the_options_of_the_next_reset_reach_the_environments_once(restarters, make):
    """The options of a program are added to those that a run passes to each reset."""
    env = make(restarters())
    env.set_options([{"start": index} for index in range(MEMBERS)])

    env.reset()
    first = [options.get("start") for options in env.get_attr("options")]
    env.reset()

    assert first == list(range(MEMBERS))
    assert all("start" not in (options or {}) for options in env.get_attr("options"))


@pytest.mark.parametrize("make", VECTORS.values(), ids=VECTORS)
def test_an_attribute_that_is_set_is_the_one_that_the_environment_reads(restarters, make):
    """Curricula set attributes.

    A new attribute must be set in the environment itself, and not in its wrapper.
    """
    env = make(restarters())
    env.reset()

    env.set_attr("level", 2)
    env.set_attr("_max_episode_steps", 9, indices=0)
    env.set_attr("fresh", "new", indices=[1])
    infos = env.step(np.zeros(MEMBERS, int))[3]

    assert [info["level"] for info in infos] == env.get_attr("level") == [2] * MEMBERS
    assert env.get_attr("_max_episode_steps") == [9, 50, 50]
    assert [getattr(it.unwrapped, "fresh", None) for it in env._targets(None)] == [None, "new", None]


def test_a_simulator_that_takes_over_has_the_attributes_that_were_set(restarters):
    """The standby has an environment of its own, which needs the attribute too."""
    [restarter, *_] = restarters()
    env = SimulatorsVecEnv([restarter], 1)
    env.reset()
    env.set_attr("level", 2)

    restarter.member.env = wrapped()
    env.reset()

    assert env.reset_infos[0]["level"] == 2


def test_an_attribute_that_is_set_while_a_simulator_is_mended_is_there_in_its_next_episode(
    restarters, monkeypatch
):
    """Only the restarter's thread may use the environment during a restart, so the attribute is set later."""
    [restarter, *_] = restarters()
    env = SimulatorsVecEnv([restarter], 1)
    env.reset()

    with monkeypatch.context() as patch:
        patch.setattr(Restarter, "busy", True)
        env.set_attr("level", 2)
        meanwhile = restarter.member.env.unwrapped.level
    env.reset()

    assert (meanwhile, env.reset_infos[0]["level"]) == (0, 2)


def test_a_vector_of_gymnasium_has_calls_and_attributes_as_the_library_s_own(restarters):
    """Training loops of other libraries call methods and read and set attributes."""
    env = FaultTolerantVectorEnv(EnvGroup(restarters("rgb_array"), lambda: None))
    reference = SyncVectorEnv([lambda: wrapped("rgb_array")] * MEMBERS)

    for each in (env, reference):
        each.reset(seed=1)
        each.set_attr("level", [1, 2, 3])
        each.set_attr("_max_episode_steps", 9)

    assert env.get_attr("level") == reference.get_attr("level") == (1, 2, 3)
    assert env.get_attr("_max_episode_steps") == reference.get_attr("_max_episode_steps")
    assert env.call("twice", 4) == reference.call("twice", 4)
    assert np.array_equal(env.render(), reference.render())
    assert env.step(np.zeros(MEMBERS, int))[4]["level"].tolist() == [1, 2, 3]
    with pytest.raises(ValueError, match="give one for each"):
        env.set_attr("level", [1])
