"""Hindsight experience replay: each simulator has a column, and faults cut episodes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from gymnasium import spaces
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.vec_env import DummyVecEnv

from palaestra_trainer.algorithms import check
from palaestra_trainer.algorithms.her import ValidHerReplayBuffer, refuse_other_observations
from palaestra_trainer.algorithms.replay_size import replay_size
from palaestra_trainer.environments import MoveToTargetGoalEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.testing import fake_arena

GOAL = spaces.Box(-100.0, 100.0, (1,), np.float32)
SPACE = spaces.Dict({"observation": GOAL, "achieved_goal": GOAL, "desired_goal": GOAL})
ACTIONS = spaces.Discrete(2)


def judge():
    """Return an object that computes rewards of goals: 1 if a goal is reached, otherwise 0."""
    return SimpleNamespace(
        env_method=lambda _, achieved, desired, *__, **___: [(achieved == desired).all(axis=-1)]
    )


def buffer_of(rows=8, members=1):
    """Return a buffer with this number of rows for each simulator."""
    return ValidHerReplayBuffer(rows * members, SPACE, ACTIONS, env=judge(), device="cpu", n_envs=members)


def add(buffer, *steps):
    """Add one vector step: each simulator's position, with the marks "done" and "bad"."""
    places = np.array([[place] for place, *_ in steps], np.float32)
    words = [step[1:] for step in steps]
    seen = {"observation": places, "achieved_goal": places, "desired_goal": places * 0 + 50}
    after = seen | {"achieved_goal": places + 1, "observation": places + 1}
    buffer.add(
        seen,
        after,
        np.zeros((len(steps), 1)),
        places[:, 0],
        np.array(["done" in word for word in words]),
        [{"palaestra": {"valid": "bad" not in word}} for word in words],
    )


def episodes(buffer, column=0):
    """Return the positions of each complete episode, by the number of its first row."""
    found = {}
    for row in np.flatnonzero(buffer.ep_length[:, column]):
        start = int(buffer.ep_start[row, column])
        found.setdefault(start, []).append(float(buffer.observations["observation"][row, column, 0]))
    return found


def test_each_member_has_a_column_and_only_whole_episodes_are_sampled():
    """An episode of one simulator ends while the other simulator's episode continues."""
    buffer = buffer_of(members=2)
    add(buffer, (0,), (10,))
    add(buffer, (1, "done"), (11,))
    add(buffer, (5,), (12,))

    assert episodes(buffer, 0) == {0: [0, 1]}
    assert episodes(buffer, 1) == {}
    assert buffer.can_sample()


def test_a_fault_closes_the_episode_at_its_last_valid_row():
    """The episode ends as truncated, so the value of its last observation is bootstrapped.

    Invalid rows are not stored, and the other simulators continue.
    """
    buffer = buffer_of(members=2)
    add(buffer, (0,), (10,))
    add(buffer, (1,), (11,))
    add(buffer, (2, "bad", "done"), (12,))
    add(buffer, (3, "bad"), (13, "done"))
    add(buffer, (4,), (14,))

    assert episodes(buffer, 0) == {0: [0, 1]}
    assert episodes(buffer, 1) == {0: [10, 11, 12, 13]}
    assert (buffer.dones[1, 0], buffer.timeouts[1, 0], buffer.timeouts[3, 1]) == (1, 1, 0)
    assert buffer.observations["observation"][2, 0, 0] == 4


def test_an_episode_whose_first_row_is_overwritten_is_forgotten_from_there():
    """The remaining rows of the old episode would otherwise get goals of the new one."""
    buffer = buffer_of(rows=4)
    for place in (0, 1, 2):
        add(buffer, (place, *(["done"] if place == 2 else [])))
    add(buffer, (3,))
    assert episodes(buffer) == {0: [0, 1, 2]}
    add(buffer, (4, "done"))

    assert episodes(buffer) == {3: [4, 3]}


def test_an_episode_longer_than_its_column_keeps_its_last_rows():
    """A long episode overwrites its own first rows."""
    buffer = buffer_of(rows=4)
    for place in range(6):
        add(buffer, (place, *(["done"] if place == 5 else [])))

    assert episodes(buffer) == {2: [4, 5, 2, 3]}


@pytest.mark.parametrize("strategy", ["future", "final", "episode"])
def test_goals_are_places_that_the_same_episode_reached(strategy):
    """A place of another simulator would not be a result of these actions.

    The reward is computed for the new goal.
    """
    buffer = ValidHerReplayBuffer(
        16, SPACE, ACTIONS, judge(), "cpu", 2, goal_selection_strategy=strategy, n_sampled_goal=3
    )
    for step in range(4):
        word = ["done"] if step == 3 else []
        add(buffer, (step, *word), (step + 20, *word))

    sample = buffer.sample(400)

    places = sample.observations["observation"].numpy().ravel()
    goals = sample.observations["desired_goal"].numpy().ravel()
    new = goals != 50
    assert new.sum() == 300
    assert ((goals[new] >= 20) == (places[new] >= 20)).all()
    if strategy != "episode":
        assert (goals[new] > places[new]).all()
    assert (sample.rewards.numpy().ravel()[new] == (goals[new] == places[new] + 1)).all()


def test_nothing_is_sampled_before_an_episode_is_whole():
    """The length of an episode is unknown before its end, so no learning takes place."""
    buffer = buffer_of()
    add(buffer, (0,))

    assert not buffer.can_sample()


def test_a_buffer_without_faults_is_that_of_stable_baselines3():
    """Without faults, a run must learn as with Stable-Baselines3, if each episode fits into a column."""
    ours = buffer_of(rows=15)
    theirs = HerReplayBuffer(15, SPACE, ACTIONS, env=judge(), device="cpu", n_envs=1)
    random = np.random.default_rng(1)
    for place in range(60):
        step = (place, *(["done"] if random.random() < 0.3 else []))
        add(ours, step)
        add(theirs, step)

        assert ours.ep_length.tolist() == theirs.ep_length.tolist()
        known = theirs.ep_length > 0
        assert ours.ep_start[known].tolist() == theirs.ep_start[known].tolist()
        assert (ours.observations["observation"] == theirs.observations["observation"]).all()


def restored(buffer, **changes):
    """Return a new buffer with the positions and rows of another, as after a resume."""
    again = buffer_of(buffer.buffer_size, buffer.n_envs)
    again.positions = buffer.positions._replace(**changes)
    again.fill(0, {name: column.copy() for name, column in buffer.rows(0, buffer.size()).items()})
    return again


@pytest.mark.parametrize("before", range(9))
def test_a_restored_buffer_goes_on_as_if_nothing_had_been(before):
    """A resumed run must learn from the same rows as a run without an interruption."""
    whole = buffer_of(rows=4, members=2)
    steps = [
        ((n, *(["done"] if n % 3 == 2 else [])), (n + 20, *(["done"] if n % 5 == 4 else [])))
        for n in range(9)
    ]
    for step in steps[:before]:
        add(whole, *step)
    again = restored(whole)
    for step in steps[before:]:
        add(whole, *step)
        add(again, *step)

    assert again.positions == whole.positions
    for name, column in whole.rows().items():
        assert (again.rows()[name] == column).all(), name


def test_an_episode_that_does_not_continue_after_a_resume_is_never_sampled():
    """After the resume the simulator begins another episode, and its rows follow those of the cut episode."""
    buffer = buffer_of()
    add(buffer, (0,))
    add(buffer, (1,))
    again = restored(buffer, newest=(None,))
    add(again, (7,))
    add(again, (8, "done"))

    assert episodes(again) == {2: [7, 8]}


def test_a_run_with_another_number_of_simulators_is_refused():
    """The columns would belong to other simulators."""
    with pytest.raises(ConfigurationError, match="the checkpoint has 2 columns, not 1; use the number"):
        buffer_of().positions = buffer_of(members=2).positions


def test_episodes_with_lost_rows_are_dropped():
    """A damaged part of a checkpoint costs only the episodes with rows in it."""
    buffer = buffer_of()
    for place in range(7):
        add(buffer, (place, *(["done"] if place in {1, 4} else [])))
    kept = np.ones(8, bool)
    kept[3] = False

    buffer.keep(kept)

    assert episodes(buffer) == {0: [0, 1]}
    add(buffer, (7, "done"))
    assert episodes(buffer)[5] == [5, 6, 7]


def test_changed_rows_are_marked_for_the_next_checkpoint():
    """The end of an episode changes all its rows, even rows in chunks that are already saved."""
    buffer = buffer_of()
    buffer.chunk_rows = 2
    for place in range(5):
        add(buffer, (place,))
    buffer.changed.clear()
    add(buffer, (5, "done"))

    assert buffer.changed == {0, 1, 2}


def test_its_size_is_computed_before_it_exists():
    """A buffer that does not fit into memory must be refused before it is made.

    The computed size includes the start and the length of the episode for each row.
    """
    buffer = buffer_of(rows=10)
    algorithm = Algorithm(
        name="DQN", hyperparameters={"buffer_size": 10, "replay_buffer_class": "HerReplayBuffer"}
    )

    size = replay_size(algorithm, SPACE, ACTIONS, steps=1000)

    assert size.memory_bytes == sum(column.nbytes for column in buffer.rows().values())


@pytest.mark.parametrize(
    ("given", "fact"),
    [
        (
            {"replay_buffer_class": "Her"},
            "replay_buffer_class: 'Her' is not a buffer; write HerReplayBuffer or module:Class",
        ),
        ({"replay_buffer_kwargs": {}}, "has no effect without replay_buffer_class"),
        ({"replay_buffer_kwargs": 4}, "replay_buffer_kwargs: 4 is refused; give a mapping"),
        (
            {"replay_buffer_kwargs": {"copy_info_dict": True}},
            "copy_info_dict: is not an option of this buffer",
        ),
        ({"replay_buffer_kwargs": {"n_sampled_goals": 4}}, "did you mean n_sampled_goal?"),
        (
            {"replay_buffer_kwargs": {"n_sampled_goal": 0}},
            "n_sampled_goal: 0 is refused; give a whole number",
        ),
        (
            {"replay_buffer_kwargs": {"goal_selection_strategy": "past"}},
            "'past' is refused; use future, final",
        ),
    ],
)
def test_wrong_options_are_refused_with_field_fact_and_remedy(given, fact):
    """The options are checked before a simulator starts, so a person waits only seconds for the error."""
    chosen = {"replay_buffer_class": "HerReplayBuffer"} | given
    if "no effect" in fact:
        del chosen["replay_buffer_class"]

    with pytest.raises(ConfigurationError) as caught:
        check(Algorithm(name="SAC", hyperparameters=chosen))

    assert fact in str(caught.value)


def test_an_algorithm_without_replay_has_no_such_hyperparameter():
    """PPO has no replay buffer and would ignore the setting."""
    with pytest.raises(ConfigurationError, match="PPO has no such hyperparameter"):
        check(Algorithm(name="PPO", hyperparameters={"replay_buffer_class": "HerReplayBuffer"}))


@pytest.mark.parametrize(
    ("space", "fact"),
    [
        (GOAL, "needs an observation that is a Dict with observation, achieved_goal and desired_goal"),
        (spaces.Dict({"observation": GOAL}), "needs an observation that is a Dict with"),
        (
            spaces.Dict(dict(SPACE.spaces) | {"desired_goal": spaces.Box(0.0, 1.0, (2,), np.float32)}),
            r"achieved_goal has the shape \(1,\) and its desired_goal \(2,\)",
        ),
    ],
)
def test_observations_without_goals_are_refused(space, fact):
    """Hindsight needs goals in the observation; the message names an environment that has them."""
    with pytest.raises(ConfigurationError, match=fact):
        refuse_other_observations(space)


def test_the_goal_environment_computes_rewards_for_a_batch():
    """Hindsight replay computes the rewards of a whole batch with one call of the environment."""
    env = DummyVecEnv([lambda: MoveToTargetGoalEnv(*fake_arena())])
    goals = np.zeros((5, 2), np.float32)

    (rewards,) = env.env_method("compute_reward", goals, goals, [{}] * 5, indices=[0])

    assert rewards.tolist() == [1.0] * 5
