"""An environment that breaks gymnasium's contract is refused, at its first step or a later one."""

# ruff: noqa: ARG002 - gymnasium names the arguments of its methods

from __future__ import annotations

import math
import re

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from palaestra_trainer.environments.contract import mismatch
from palaestra_trainer.errors import ConfigurationError
from tests.unit.trainer.environments.hall import Hall

PAIR = spaces.Dict({"a": spaces.Discrete(2), "image": spaces.Box(0, 255, (36, 36, 1), np.uint8)})


class NoSeed(Hall):
    """An environment whose `reset` accepts no seed, as in old releases of gym."""

    def reset(self):
        """Begin an episode."""
        return self.observe()


class OldStep(Hall):
    """An environment whose `step` returns no truncation, as in old releases of gym."""

    def step(self, action):
        """Take a step."""
        return self.observe(), 1.0, False, {}


class NoInfo(Hall):
    """An environment whose `reset` returns only the observation."""

    def reset(self, *, seed=None, options=None):
        """Begin an episode."""
        return self.observe()


class NumberAsEnd(Hall):
    """An environment whose `terminated` is a number."""

    def step(self, action):
        """Take a step."""
        return self.observe(), 1.0, 0.0, False, {}


class NoSpace(Hall):
    """An environment without an observation space."""

    observation_space = None


class Wide(Hall):
    """An environment whose observation is too long."""

    seen = (0.0, 0.0, 0.0)


class Listed(Hall):
    """An environment whose observation is a list."""

    def observe(self):
        """Return the list."""
        return [0.0, 0.0]


class Double(Hall):
    """An environment whose observation has double precision."""

    dtype = np.float64


class Outside(Hall):
    """An environment whose observation is outside its space."""

    seen = (0.0, 1.5)


class TextReward(Hall):
    """An environment whose reward is a text."""

    reward = "much"


@pytest.mark.parametrize(
    ("creator", "facts"),
    [
        (NoSeed, ["expected reset(self, *, seed=None, options=None)", "got reset()"]),
        (NoInfo, ["returns (observation, info)", "got a ndarray"]),
        (OldStep, ["(observation, reward, terminated, truncated, info)", "got a tuple of 4"]),
        (NumberAsEnd, ["got Expects `terminated` signal to be a boolean", "<class 'float'>;"]),
        (NoSpace, ["expected an observation_space of gymnasium.spaces", "NoneType"]),
        (Wide, ["shape (3,), not (2,)"]),
        (Listed, ["from reset an observation of Box", "got a list"]),
        (Double, ["dtype float64, not float32"]),
        (Outside, ["1.5 at [1], not between -1.0 and 1.0"]),
        (TextReward, ["reward", "str"]),
    ],
    ids=lambda it: getattr(it, "__name__", ""),
)
@pytest.mark.parametrize("limit", [None, 10])
def test_a_wrong_environment_is_refused_at_its_first_reset_or_step(made, creator, facts, limit):
    """An author sees in the message what was expected and what was returned.

    With a time limit, gymnasium's own wrapper reads the result of `step` first.
    """

    def first_step():
        env = made(creator, registration={"max_episode_steps": limit})
        env.reset(seed=1)
        env.step(0)

    with pytest.raises(ConfigurationError) as refusal:
        first_step()

    message = str(refusal.value)
    assert message.startswith("environment.id: Hall-v0: expected ")
    assert message.endswith("; fix the environment")
    assert [fact for fact in facts if fact not in message] == []


RIGHT = (np.zeros(2, np.float32), 1.0, False, False, {})
LATER = [
    ("no reward", (RIGHT[0], None, *RIGHT[2:]), "got a NoneType as reward, in step 3 of its episode 2"),
    ("a truth as reward", (RIGHT[0], True, *RIGHT[2:]), "got a bool as reward"),
    ("an array as reward", (RIGHT[0], np.ones(1), *RIGHT[2:]), "got a ndarray as reward"),
    ("four values", RIGHT[:4], "got a tuple of 4: (ndarray, float, bool, bool), in step 3"),
    ("no tuple", None, "got a NoneType, in step 3"),
    ("a number as end", (*RIGHT[:2], 0, False, {}), "got a int as terminated"),
    ("no info", (*RIGHT[:4], None), "got a NoneType as info"),
    (
        "another shape",
        (np.zeros(3, np.float32), *RIGHT[1:]),
        "that does not fit its space (shape (3,), not (2,))",
    ),
    ("another dtype", (np.zeros(2), *RIGHT[1:]), "that does not fit its space (dtype float64, not float32)"),
    ("a list", ([0.0, 0.0], *RIGHT[1:]), "that does not fit its space (a list)"),
]


@pytest.mark.parametrize("limit", [None, 10])
@pytest.mark.parametrize(("answer", "fact"), [row[1:] for row in LATER], ids=[row[0] for row in LATER])
def test_a_step_that_breaks_the_contract_later_is_refused_with_its_number(made, answer, fact, limit):
    """Without the check, PyTorch or NumPy would raise an error a thousand steps later, or never."""

    class Later(Hall):
        steps = resets = 0

        def reset(self, *, seed=None, options=None):
            self.steps, self.resets = 0, self.resets + 1
            return super().reset(seed=seed, options=options)

        def step(self, action):
            self.steps += 1
            return answer if (self.resets, self.steps) == (2, 3) else super().step(action)

    env = made(Later, registration={"max_episode_steps": limit})
    for _ in range(2):
        env.reset(seed=1)
        env.step(0)
        env.step(0)

    with pytest.raises(ConfigurationError, match=re.escape(fact)):
        env.step(0)


def test_a_later_reset_that_breaks_the_contract_is_refused(made):
    """Often `reset` has two branches and returns no info in one of them."""

    class Later(Hall):
        resets = 0

        def reset(self, *, seed=None, options=None):
            self.resets += 1
            right = super().reset(seed=seed, options=options)
            return right if self.resets == 1 else right[0]

    env = made(Later)
    env.reset(seed=1)

    with pytest.raises(ConfigurationError, match="got a ndarray, in a later reset; fix the environment"):
        env.reset(seed=2)


def test_a_wrapper_of_the_registration_is_checked_too(made):
    """A wrapper may make a valid observation invalid."""

    class Stretched(gymnasium.ObservationWrapper):
        def observation(self, observation):
            return np.append(observation, 0.0)

    env = made(lambda robot, scene: Stretched(Hall(robot, scene)))

    with pytest.raises(ConfigurationError, match="shape"):
        env.reset(seed=1)


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_numbers_that_are_not_finite_are_left_to_the_learner(made, number):
    """NaN and infinity have an exit code of their own, which the learner sets."""

    class Divided(Hall):
        seen = (number, 0.0)
        reward = number

    env = made(Divided)

    env.reset(seed=1)
    env.step(0)


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_numbers_in_a_dict_that_are_not_finite_are_left_to_the_learner(made, number):
    """The learner's message has the key of the observation, while gymnasium's has not."""

    class Divided(Hall):
        observation_space = spaces.Dict({"a": Hall.observation_space})

        def observe(self):
            return {"a": np.array([number, 0.0], np.float32)}

    env = made(Divided)

    env.reset(seed=1)
    env.step(0)


def test_a_simulator_s_fault_passes(made):
    """The simulator caused the error, so the check waits for the first successful reset."""

    class Faulty(Hall):
        tries = 0

        def reset(self, *, seed=None, options=None):
            self.tries += 1
            if self.tries == 1:
                raise TimeoutError
            return self.observe()

    env = made(Faulty)

    with pytest.raises(TimeoutError):
        env.reset(seed=1)
    with pytest.raises(ConfigurationError):
        env.reset(seed=1)


@pytest.mark.parametrize(
    ("space", "observation", "fact"),
    [
        (spaces.Box(0, 255, (2, 2), np.uint8), np.zeros((2, 2), np.uint8), ""),
        (spaces.Box(-1.0, 1.0, ()), np.float32(0.5), ""),
        (spaces.Discrete(3), 3, "3"),
        (spaces.Dict({"a": spaces.Discrete(2)}), {"a": 1}, ""),
        (PAIR, {"a": 1, "image": np.zeros((36, 36, 1))}, "image: dtype float64, not uint8"),
        (PAIR, {"a": 2, "image": np.zeros((36, 36, 1), np.uint8)}, "a: 2"),
        (PAIR, {"a": 1, "b": 1}, "the keys a, b, not a, image"),
        (PAIR, np.zeros(2), "a ndarray"),
        (spaces.MultiBinary(40), np.zeros(41, np.int8), "shape (41,), not (40,)"),
    ],
)
def test_a_mismatch_is_described_in_words(space, observation, fact):
    """Gymnasium's `contains` returns only False, but a person needs the reason.

    The text is empty if the value is in the space.
    """
    assert mismatch(space, observation) == fact
