"""An environment may keep and change each object that it gets or returns.

Each test plays with a hostile environment, and with an honest one that returns new objects. The results must
be equal.
"""

from __future__ import annotations

from types import MappingProxyType

import gymnasium
import numpy as np
import pytest
import structlog
from gymnasium import spaces

from palaestra_trainer.environments.copies import copied
from palaestra_trainer.episodes.evaluation import evaluate
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.run.fault_tolerant.env import FaultTolerantEnv
from palaestra_trainer.run.fault_tolerant.env_group import EnvGroup
from palaestra_trainer.run.fault_tolerant.sb3_vec_env import FaultTolerantVecEnv
from palaestra_trainer.run.fault_tolerant.vector_env import FaultTolerantVectorEnv
from palaestra_trainer.simulators.restarter import Restarter

LENGTH = 3
STEPS = 8
OBSERVED = spaces.Dict({"numbers": spaces.Box(-100, 100, (2,), np.float32), "place": spaces.Discrete(9)})
ACTED = spaces.Box(-1, 1, (2,), np.float32)


class Honest(gymnasium.Env):
    """An environment with episodes of three steps, in which each returned object is new."""

    observation_space, action_space = OBSERVED, ACTED

    def reset(self, *, seed=None, options=None):
        """Begin an episode, whose course does not depend on earlier ones."""
        super().reset(seed=seed)
        self.step_number, self.sum = 0, np.zeros(2, np.float32)
        return self.seen(np.full(2, -50, np.float32)), {"begun": [seed is not None, dict(options or {})]}

    def step(self, action):
        """Add the action to the state."""
        self.step_number += 1
        self.sum = self.sum + action
        seen = self.seen(self.sum + self.step_number)
        return seen, float(self.sum[0]), False, self.step_number == LENGTH, {"sums": [self.sum.tolist()]}

    def seen(self, numbers):
        """Return a new observation."""
        return {"numbers": numbers, "place": self.step_number}


class Hostile(Honest):
    """An environment that always returns the same objects, and changes the objects that it gets."""

    def __init__(self):
        self.numbers = np.zeros(4, np.float32)[::2]  # an array that is not contiguous
        self.observation = {"numbers": self.numbers, "place": 0}
        self.sums = []
        self.info = {}

    def reset(self, *, seed=None, options=None):
        """Begin an episode, and empty the options."""
        seen, info = super().reset(seed=seed, options=options)
        (options or {}).clear()
        self.info.clear()
        self.info.update(info)
        return seen, self.info

    def step(self, action):
        """Add the action to the state, and overwrite it."""
        seen, reward, terminated, truncated, info = super().step(action)
        action *= 0
        self.info.clear()
        self.sums[:] = info["sums"]
        self.info["sums"] = self.sums
        return seen, reward, terminated, truncated, self.info

    def seen(self, numbers):
        """Return the one observation object."""
        self.numbers[:] = numbers
        self.observation["place"] = self.step_number
        return self.observation


class Frozen(Hostile):
    """An environment whose infos are read-only."""

    def reset(self, *, seed=None, options=None):
        """Begin an episode."""
        seen, info = super().reset(seed=seed, options=options)
        return seen, MappingProxyType(info)

    def step(self, action):
        """Take a step."""
        *others, info = super().step(action)
        return *others, MappingProxyType(info)


@pytest.fixture
def restarter(make_member):
    """Return a function that makes the restarter of a simulator with an environment."""

    def make(environment):
        member = make_member("collect-0")
        member.env = environment()
        return Restarter(member)

    return make


def actions():
    """Return the actions of one simulator, which are the same for each environment."""
    return np.random.default_rng(1).uniform(-1, 1, (STEPS, 1, 2)).astype(np.float32)


def collected(restarter):
    """Return the rows of the training loop, and the actions that an exact resume would repeat."""
    env = SimulatorsVecEnv([restarter], 1)
    rows = [env.reset(), *(env.step(action) for action in actions())]
    return rows, env.reset_infos, env.snapshot()[0].actions


def tolerated(restarter):
    """Return the rows of the vector environment for Stable-Baselines3."""
    env = FaultTolerantVecEnv(EnvGroup([restarter], lambda: None))
    env.seed(1)
    return [env.reset(), *(env.step(action) for action in actions())], env.reset_infos


def vectorized(restarter):
    """Return the rows of the vector environment for gymnasium."""
    env = FaultTolerantVectorEnv(EnvGroup([restarter], lambda: None))
    return [env.reset(seed=1, options={"word": 1}), *(env.step(action) for action in actions())]


def alone(restarter):
    """Return the rows of the environment for a single simulator."""
    env = FaultTolerantEnv(EnvGroup([restarter], lambda: None))
    rows = []
    for number, [action] in enumerate(actions()):
        if number % LENGTH == 0:
            rows.append(env.reset(seed=1, options={"word": 1}))
        rows.append(env.step(action))
    return rows


def evaluated(restarter):
    """Return the episodes of an evaluation."""
    return [episode.record() for episode in evaluate(Fixed(), restarter, [1, 2]).episodes]


class Fixed:
    """A policy that always returns the same array."""

    action = np.array([0.5, -0.5], np.float32)

    def predict(self, _observation, state=None, _episode_start=None, **_options):
        """Return the array."""
        return self.action, state


def plain(value):
    """Return a value with its arrays as lists, and without the durations of episodes."""
    if isinstance(value, dict):
        return {key: plain(part) for key, part in value.items() if key != "t"}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    return plain(value.tolist()) if isinstance(value, np.ndarray | np.generic) else value


@pytest.mark.parametrize("played", [collected, tolerated, vectorized, alone, evaluated])
@pytest.mark.parametrize("hostile", [Hostile, Frozen])
def test_what_an_environment_does_with_its_objects_changes_nothing(restarter, played, hostile):
    """An environment may return the same array each time, and overwrite the actions that it gets.

    Without copies, the last observation of an episode would be the first of the next one, and a resume would
    repeat other actions.
    """
    assert plain(played(restarter(hostile))) == plain(played(restarter(Honest)))


def test_actions_of_the_training_loop_stay_as_they_are(restarter):
    """The loop stores the actions in a buffer after the step."""
    given = actions()[0]
    env = SimulatorsVecEnv([restarter(Hostile)], 1)
    env.reset()

    env.step(given)

    assert (given == actions()[0]).all()


class Judge(Honest):
    """A task that writes the rewards into the memory of the goals."""

    def compute_reward(self, achieved, desired, _info):
        """Return the distances of the goals."""
        achieved -= desired
        return np.abs(achieved).sum(axis=1)


def test_goals_whose_reward_was_computed_stay_as_they_are(restarter):
    """Hindsight replay computes rewards from the goals and then stores them, so they must not change."""
    env = SimulatorsVecEnv([restarter(Honest)], 1, judge=Judge())
    achieved, desired = np.ones((4, 2)), np.zeros((4, 2))

    [rewards] = env.env_method("compute_reward", achieved, desired, {})

    assert rewards.tolist() == [2.0] * 4
    assert achieved.tolist() == np.ones((4, 2)).tolist()


class Rising(Honest):
    """An environment that raises its own level at each reset, and records its levels."""

    level, words = 0, ()

    def reset(self, *, seed=None, options=None):
        """Raise the level, and begin an episode."""
        self.level += 1
        self.words = [*self.words, self.level]
        return super().reset(seed=seed, options=options)


def test_an_attribute_is_set_once_and_what_the_environment_makes_of_it_stays(restarter):
    """If the attribute were set at each reset, a level that the environment raises would fall back."""
    env = SimulatorsVecEnv([restarter(Rising)], 1)
    env.reset()
    words = ["first"]
    env.set_attr("level", 5)
    env.set_attr("words", words)
    words.append("mine")

    env.reset()
    env.reset()

    assert env.get_attr("level") == [7]
    assert env.get_attr("words") == [["first", 6, 7]]


class WithWords(Honest):
    """An environment with keys in its infos that have another meaning here and in Stable-Baselines3."""

    def step(self, action):
        """Take a step, and return these keys."""
        *others, _ = super().step(action)
        words = ("valid", "episode", "sim_fault", "recovering", "extra_steps", "terminal_observation")
        return *others, {**dict.fromkeys(words, "mine"), "palaestra": "mine"}


def test_words_of_an_environment_are_not_taken_for_ours(restarter):
    """Keys that Stable-Baselines3 uses itself are moved to `hidden`, and a log line reports this.

    All others stay.
    """
    env = SimulatorsVecEnv([restarter(WithWords)], 1)
    env.reset()
    with structlog.testing.capture_logs() as logged:
        infos = [env.step(action)[3][0] for action in actions()]

    assert [info["palaestra"]["valid"] for info in infos] == [True] * STEPS
    assert {(info["valid"], info["sim_fault"], info["extra_steps"]) for info in infos} == {("mine",) * 3}
    assert [info["episode"]["l"] for info in infos if "episode" in info] == [LENGTH] * (STEPS // LENGTH)
    hidden = {"episode": "mine", "terminal_observation": "mine", "palaestra": "mine"}
    assert [info["palaestra"]["hidden"] for info in infos] == [hidden] * STEPS
    assert sorted(line["word"] for line in logged) == sorted(hidden)


def test_a_copy_shares_nothing_that_can_be_written_into():
    """A robot in an info cannot be copied, so objects of other classes are shared."""
    robot = object()
    value = {"array": np.zeros((2, 2), order="F"), "parts": [({1, 2}, bytearray(b"a"))], "robot": robot}

    copy = copied(MappingProxyType(value))
    value["array"][0, 0] = 7
    value["parts"][0][0].add(3)
    value["parts"][0][1][0] = 0

    assert copy["array"].sum() == 0
    assert copy["parts"] == [({1, 2}, bytearray(b"a"))]
    assert copy["robot"] is robot
