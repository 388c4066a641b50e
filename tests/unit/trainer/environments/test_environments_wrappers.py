"""A job's wrappers and its stacked frames."""

# ruff: noqa: ARG002 - gymnasium names the arguments of its methods

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from stable_baselines3.common.vec_env import DummyVecEnv, VecFrameStack

from palaestra_trainer.environments.env_checker import refuse_statistics
from palaestra_trainer.environments.make import keywords, make_environment
from palaestra_trainer.environments.wrappers import StackedFrames, wrapped
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Environment
from palaestra_trainer.testing import fake_arena

NAME = "Count-v0"
HERE = "gymnasium.wrappers"
SPACES = {
    "numbers": spaces.Box(-np.ones(3, np.float32), np.arange(1, 4, dtype=np.float32)),
    "table": spaces.Box(-9.0, 9.0, (2, 3), np.float32),
    "image": spaces.Box(0, 255, (5, 4, 3), np.uint8),
    "image with channels first": spaces.Box(0, 255, (1, 5, 4), np.uint8),
    "image of other bounds": spaces.Box(0, 9, (1, 5, 4), np.uint8),
}


class Count(gymnasium.Env):
    """An environment that ends after three steps; with `reuses` it returns the same array each time."""

    action_space = spaces.Discrete(2)

    def __init__(self, robot=None, scene=None, space=SPACES["numbers"], *, reuses=True):
        self._reuses = reuses
        self.observation_space = space
        self._seen = np.zeros(space.shape, space.dtype)

    def reset(self, *, seed=None, options=None):
        """Begin an episode."""
        super().reset(seed=seed)
        self._steps = 0
        return self._observe(), {}

    def step(self, action):
        """Take a step."""
        self._steps += 1
        return self._observe(), 10.0, self._steps == 3, False, {}

    def _observe(self):
        self._seen[...] = self._steps + 1 if self._seen.dtype == np.uint8 else (self._steps + 1) / 10
        return self._seen if self._reuses else self._seen.copy()


@pytest.fixture
def registered():
    """Register the environment for the time of the test."""
    gymnasium.register(id=NAME, entry_point=Count)
    yield
    gymnasium.registry.pop(NAME, None)


def made(**task):
    """Return the environment as a run makes it."""
    return make_environment(Environment(id=NAME, **task), *fake_arena())


@pytest.mark.parametrize("name", SPACES)
def test_frames_are_stacked_as_stable_baselines_does(name):
    """Hyperparameters that were tuned with VecFrameStack depend on its layout and its zeros."""
    space = SPACES[name]
    theirs = VecFrameStack(DummyVecEnv([lambda: Count(space=space, reuses=False)]), 3)
    ours = StackedFrames(Count(space=space), 3)

    assert ours.observation_space.shape == theirs.observation_space.shape
    seen, _ = ours.reset()
    assert np.array_equal(seen, theirs.reset()[0])
    for _ in range(2):
        seen, *_ = ours.step(0)
        assert np.array_equal(seen, theirs.step([0])[0][0])
    last, *_ = ours.step(0)
    [info] = theirs.step([0])[3]
    assert np.array_equal(last, info["terminal_observation"])
    assert last.dtype == space.dtype
    assert last in ours.observation_space


def test_each_frame_has_the_bounds_of_its_numbers():
    """VecFrameStack of Stable-Baselines3 repeats the bounds of the first number.

    If a number had the bounds of another one, valid observations would be rejected.
    """
    bounds = StackedFrames(Count(), 2).observation_space

    assert bounds.low.tolist() == [-1.0] * 6
    assert bounds.high.tolist() == [1.0, 2.0, 3.0, 1.0, 2.0, 3.0]


def test_an_observation_that_was_returned_does_not_change_later():
    """A buffer keeps the returned arrays, and each row would get the newest frames."""
    env = StackedFrames(Count(), 2)
    first, _ = env.reset()
    kept = first.copy()

    env.step(0)
    env.reset()

    assert np.array_equal(first, kept)


def test_an_observation_of_another_kind_cannot_be_stacked():
    """Hindsight replay calls `compute_reward` with a goal, which must not be stacked."""
    env = Count()
    env.observation_space = spaces.Dict({"a": SPACES["numbers"]})

    with pytest.raises(ConfigurationError, match=r"environment\.frameStack: the observation is a Dict"):
        StackedFrames(env, 2)


@pytest.mark.usefixtures("registered")
def test_wrappers_are_put_around_the_environment_in_their_order():
    """The first wrapper is the innermost, so the second one gets its reward."""
    reward = {"name": f"{HERE}:ClipReward", "options": {"min_reward": -1, "max_reward": 2}}
    limit = {"name": f"{HERE}:TimeLimit", "options": {"max_episode_steps": 2}}
    env = made(wrappers=[reward, limit], frameStack=2)

    env.reset(seed=1)
    env.step(0)
    seen, paid, terminated, truncated, _ = env.step(0)

    assert (paid, terminated, truncated) == (2.0, False, True)
    assert seen.tolist() == pytest.approx([0.2] * 3 + [0.3] * 3)
    names = [type(layer).__name__ for layer in layers(env)]
    assert names.index("StackedFrames") < names.index("TimeLimit") < names.index("ClipReward")


def layers(env):
    """Yield an environment and all environments inside it."""
    yield env
    if isinstance(env, gymnasium.Wrapper):
        yield from layers(env.env)


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize(
    ("wrapper", "fact"),
    [
        ({"name": "nowhere:Own"}, "[0].name: nowhere:Own cannot be imported"),
        ({"name": f"{HERE}:None_"}, f"[0].name: {HERE}:None_ cannot be imported"),
        ({"name": "gymnasium:Env"}, "[0].name: gymnasium:Env is not a subclass of Wrapper"),
        (
            {"name": f"{HERE}:TimeLimit"},
            f"[0].options.max_episode_steps: {HERE}:TimeLimit needs this argument",
        ),
        (
            {"name": f"{HERE}:TimeLimit", "options": {"max_episode_step": 1, "max_episode_steps": 1}},
            "has no such argument; did you mean max_episode_steps?",
        ),
    ],
)
def test_a_wrapper_that_cannot_be_used_is_refused_before_a_simulator_starts(wrapper, fact):
    """The class alone shows the mistake, so no simulator need be started."""
    with pytest.raises(ConfigurationError, match=r"environment\.wrappers\[0\]") as refusal:
        keywords(Environment(id=NAME, wrappers=[wrapper]))

    assert fact in str(refusal.value)


@pytest.mark.usefixtures("registered")
def test_a_wrapper_that_raises_is_named():
    """The author of the job may have written the wrapper, and must find the mistake in it."""
    wrapper = {"name": f"{HERE}:TimeLimit", "options": {"max_episode_steps": -1}}

    with pytest.raises(
        ConfigurationError, match=r"wrappers\[0\]: gymnasium.wrappers:TimeLimit cannot be created"
    ):
        made(wrappers=[wrapper])


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize("name", ["NormalizeObservation", "NormalizeReward"])
def test_wrappers_with_statistics_are_refused_as_ever(name):
    """No model stores these statistics, and each simulator would have its own."""
    env = made(wrappers=[{"name": f"{HERE}:{name}"}])

    with pytest.raises(ConfigurationError, match=f"{name} has statistics that the policy's file lacks"):
        refuse_statistics(env, NAME)


def test_without_wrappers_the_environment_stays_as_it_is():
    """A needless wrapper would hide attributes of the environment from a program."""
    env = Count()

    assert wrapped(env, Environment(id=NAME)) is env
