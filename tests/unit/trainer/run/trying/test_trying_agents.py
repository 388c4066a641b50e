"""The agents that act in an environment that a person tries."""

from __future__ import annotations

import os
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from palaestra_trainer.environments.masks import all_allowed, allows
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.geometry import Movement
from palaestra_trainer.run.signals import Interrupted
from palaestra_trainer.run.trying.agents import EndEpisode, EndTry, Random, Zero, names_of_actions, zero_of
from palaestra_trainer.run.trying.keyboard import KeyboardDriver
from palaestra_trainer.run.trying.keymap import DOWN, LEFT, RIGHT, SPACE, UP, decode, keys_of, legend
from palaestra_trainer.waiting.check import go_on

MASKED = (spaces.Discrete(4, start=2), spaces.MultiDiscrete([2, 3]), spaces.MultiBinary(3))
SPACES = (
    *MASKED,
    spaces.Box(-1.0, 1.0, (2,), np.float32),
    spaces.Box(0.5, 1.0, (1,), np.float32),
    spaces.Box(0, 255, (2, 2), np.uint8),
    spaces.Dict({"a": spaces.Discrete(2), "b": spaces.Box(-1.0, 1.0, (1,), np.float32)}),
    spaces.Tuple((spaces.Discrete(2), spaces.MultiBinary(2))),
)


@pytest.mark.parametrize("space", SPACES, ids=str)
def test_zero_and_random_actions_are_in_every_space(space):
    """An action outside the space would be our mistake, but the environment would be blamed."""
    assert space.contains(Zero(space).act(None))
    assert space.contains(Random(space, 1).act(None))


def test_zero_is_the_nearest_point_where_the_bounds_exclude_it():
    """A gripper, for example, may open from 0.5 to 1."""
    assert zero_of(SPACES[4]).tolist() == [0.5]


@pytest.mark.parametrize("space", MASKED, ids=str)
def test_random_actions_obey_a_mask(space):
    """An environment may raise an error for an action that its mask forbids."""
    agent, generator = Random(space, 1), np.random.default_rng(1)
    for _ in range(50):
        mask = all_allowed(space)
        mask[generator.integers(len(mask))] = False

        action = agent.act(mask)

        assert space.contains(action)
        assert allows(mask, space, action - getattr(space, "start", 0))


def test_the_same_seed_chooses_the_same_actions():
    """A person can then repeat an episode with a problem."""
    ours, theirs = Random(SPACES[0], 7), Random(SPACES[0], 7)

    assert [ours.act(None) for _ in range(20)] == [theirs.act(None) for _ in range(20)]


def test_arrows_are_the_movements_that_an_environment_names():
    """A person at the keyboard does not know the numbers of the movements."""
    env = gymnasium.Env()
    env.options = SimpleNamespace(movements=(Movement.STOP, Movement.FORWARD, Movement.TURN_LEFT))
    names = names_of_actions(env)
    space = spaces.Discrete(3)

    keys = keys_of(space, names)

    assert {key: int(keys[key]) for key in (UP, SPACE, "2")} == {UP: 1, SPACE: 0, "2": 2}
    assert legend(keys, names).startswith("keys: up: forward, space: stop, 0: stop")


def test_without_names_arrows_are_the_first_actions():
    """A person can then try any small Discrete space."""
    keys = keys_of(spaces.Discrete(3, start=5))

    assert [int(keys[key]) for key in (UP, LEFT, RIGHT)] == [5, 6, 7]
    assert DOWN not in keys


def test_arrows_are_the_bounds_of_the_first_two_numbers():
    """In most environments of driving robots, these numbers are the velocity ahead and the turn."""
    space = spaces.Box(np.float32([-1, -2]), np.float32([3, 4]))

    keys = keys_of(space)

    assert {key: keys[key].tolist() for key in keys} == {
        SPACE: [0, 0],
        UP: [3, 0],
        DOWN: [-1, 0],
        LEFT: [0, 4],
        RIGHT: [0, -2],
    }
    assert all(map(space.contains, keys.values()))


@pytest.mark.parametrize(
    "space",
    [
        spaces.Discrete(11),
        spaces.Box(-1.0, 1.0, (4,), np.float32),
        spaces.Box(-np.inf, np.inf, (1,), np.float32),
        spaces.MultiBinary(2),
    ],
    ids=str,
)
def test_actions_for_which_a_person_has_too_few_keys_are_refused(space):
    """The message proposes `--agent random` instead."""
    with pytest.raises(ConfigurationError, match=r"--agent keyboard: the actions are .*use --agent random"):
        keys_of(space)


@pytest.mark.parametrize(
    ("typed", "keys", "rest"),
    [
        (b"\x1b[A\x1b[B\x1b[C\x1b[D", [UP, DOWN, RIGHT, LEFT], b""),
        (b"\x1bOA ", [UP, SPACE], b""),
        (b"Q3", ["q", "3"], b""),
        (b"\x1b[", [], b"\x1b["),
        (b"n\x1b", ["n"], b"\x1b"),
        (b"\x04", ["q"], b""),
        (b"\xff", ["\ufffd"], b""),
    ],
)
def test_the_bytes_of_a_terminal_are_keys(typed, keys, rest):
    """The bytes of an arrow key may arrive in two reads."""
    assert decode(typed) == (keys, rest)


@pytest.fixture
def typing():
    """Yield a keyboard, the end of the pipe for typing, and the list of lines that it shows."""
    reader, writer = os.pipe()
    shown: list[str] = []
    with os.fdopen(reader, "rb", buffering=0), os.fdopen(writer, "wb", buffering=0) as typed:
        yield KeyboardDriver(reader, {UP: 1, SPACE: 0}, go_on, shown.append), typed, shown


def test_each_key_is_an_action_and_others_have_no_effect(typing):
    """A person may touch other keys by accident."""
    keyboard, typed, shown = typing
    typed.write(b"x\x1b[A ")

    assert (keyboard.act(None), keyboard.act(None)) == (1, 0)
    keyboard.got(1, 0.5)
    assert shown == ["step 1: reward 0.500"]


@pytest.mark.parametrize(("key", "end"), [(b"n", EndEpisode), (b"q", EndTry)])
def test_a_key_ends_the_episode_or_all(typing, key, end):
    """A person who has seen a problem need not play the episode to its end."""
    keyboard, typed, _ = typing
    typed.write(key)

    with pytest.raises(end):
        keyboard.act(None)


def test_a_terminal_that_is_closed_ends_all(typing):
    """No key can arrive any more, so the program would wait for ever."""
    keyboard, typed, _ = typing
    typed.close()

    with pytest.raises(EndTry):
        keyboard.act(None)


def test_a_signal_ends_the_wait_for_a_key(typing):
    """After Ctrl-C, a person must not have to press another key."""
    keyboard, _, _ = typing

    def interrupted():
        raise Interrupted("SIGTERM received")

    keyboard._check = interrupted

    with pytest.raises(Interrupted):
        keyboard.act(None)
