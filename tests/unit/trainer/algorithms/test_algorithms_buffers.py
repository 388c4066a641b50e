"""Buffers keep invalid rows out of every loss."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from gymnasium import spaces
from hypothesis import given
from hypothesis import strategies as st
from stable_baselines3.common.buffers import RolloutBuffer

from palaestra_trainer.algorithms import buffers
from palaestra_trainer.algorithms.buffers import ValidReplayBuffer, ValidRolloutBuffer, valid_rows

SPACE = spaces.Box(-1.0, 1.0, (1,), np.float32)
ACTIONS = spaces.Discrete(2)


def replay(size=8, members=2):
    """Return an empty replay buffer."""
    return ValidReplayBuffer(size, SPACE, ACTIONS, "cpu", members)


def add(buffer, marks, valid):
    """Add one vector step; the reward of a row serves as its number."""
    column = np.array(marks, np.float32)
    buffer.add(
        column[:, None],
        column[:, None] + 0.5,
        np.zeros(len(marks), int),
        column,
        np.zeros(len(marks), bool),
        [{"palaestra": {"valid": it}} for it in valid],
    )


def in_order(buffer):
    """Return the columns of the rows in use, oldest row first, as lists."""
    shift = buffer.positions.next if buffer.positions.full else 0
    used = {name: column[: buffer.size()] for name, column in buffer.rows().items()}
    return {name: np.roll(column, -shift, axis=0).squeeze((1,)).tolist() for name, column in used.items()}


def rollout(rewards, valid, starts, *, kind=ValidRolloutBuffer, gamma=0.9):
    """Return a full rollout of one simulator with the values 1, 2, 3 and so on."""
    buffer = kind(len(rewards), SPACE, ACTIONS, "cpu", gae_lambda=0.8, gamma=gamma, n_envs=1)
    for row, (reward, is_valid, start) in enumerate(zip(rewards, valid, starts, strict=True)):
        if kind is ValidRolloutBuffer:
            buffer.mark(np.array([is_valid]))
        buffer.add(
            np.array([[row / 10]]),
            np.zeros((1, 1)),
            np.array([reward]),
            np.array([start]),
            torch.tensor([[float(row + 1)]]),
            torch.zeros(1),
        )
    return buffer


def test_a_row_is_valid_unless_it_says_otherwise():
    """Environments of other projects return infos without the entry `valid`."""
    assert valid_rows([{}, {"palaestra": {"valid": True}}, {"palaestra": {"valid": False}}]).tolist() == [
        True,
        True,
        False,
    ]


@given(st.lists(st.tuples(st.booleans(), st.booleans()), max_size=20))
def test_a_replay_buffer_holds_the_newest_valid_rows_in_order(steps):
    """An invalid row must leave no gap, and must not displace a valid row."""
    buffer = replay(size=8)
    expected = []
    for number, valid in enumerate(steps):
        marks = [2 * number, 2 * number + 1]
        add(buffer, marks, valid)
        expected += [mark for mark, is_valid in zip(marks, valid, strict=True) if is_valid]

    assert in_order(buffer)["rewards"] == expected[-8:]
    assert buffer.size() == min(len(expected), 8)


def test_the_row_before_a_fault_ends_as_truncated():
    """The policy did not cause the fault, so the value after the last valid row is bootstrapped."""
    buffer = replay()
    add(buffer, [1, 2], [True, True])

    add(buffer, [3, 4], [False, True])

    rows = in_order(buffer)
    assert rows["rewards"] == [1, 2, 4]
    assert rows["dones"] == [1, 0, 0]
    assert rows["timeouts"] == [1, 0, 0]


def test_a_row_that_took_the_place_of_another_member_s_newest_is_not_truncated():
    """In a full buffer, the other simulator may have overwritten the broken simulator's newest row."""
    buffer = replay(size=4)
    add(buffer, [1.0, 2.0], [True, True])
    for mark in (3.0, 4.0, 5.0):  # row 5.0 replaces row 1.0
        add(buffer, [0.0, mark], [False, True])

    add(buffer, [0.0, 6.0], [False, True])

    assert in_order(buffer)["rewards"] == [3.0, 4.0, 5.0, 6.0]
    assert in_order(buffer)["timeouts"] == [0.0] * 4


def test_a_fault_at_once_truncates_nothing():
    """The broken simulator has no earlier row that could be marked as truncated."""
    buffer = replay()

    add(buffer, [1, 2], [False, False])

    assert buffer.size() == 0


@pytest.mark.parametrize("steps", [0, 1, 3, 4, 7])
def test_a_replay_buffer_goes_back_to_where_it_stood(steps):
    """After a resume, the same transitions are stored at the same positions before any row is sampled."""
    buffer = replay(size=8)
    for number in range(steps):
        add(buffer, [2 * number, 2 * number + 1], [True, True])
    stood = buffer.positions
    add(buffer, [98, 99], [True, False])
    expected, after = in_order(buffer), buffer.positions

    buffer.positions = stood
    add(buffer, [98, 99], [True, False])

    assert buffer.positions == after
    assert in_order(buffer) == expected


@pytest.mark.parametrize("steps", [2, 7])
def test_a_replay_buffer_can_do_without_some_rows(steps):
    """Rows of a damaged file are dropped. The others stay in order, and the oldest is overwritten first."""
    buffer = replay(size=8)
    for number in range(steps):
        add(buffer, [2 * number, 2 * number + 1], [True, True])
    before = in_order(buffer)["rewards"]
    lost = buffer.rows()["rewards"][2:4].flatten().tolist()

    kept = np.ones(8, bool)
    kept[2:4] = False
    buffer.keep(kept)

    assert in_order(buffer)["rewards"] == [mark for mark in before if mark not in lost]
    add(buffer, [98, 99], [True, True])
    assert in_order(buffer)["rewards"][-2:] == [98, 99]


def test_a_replay_buffer_knows_which_chunks_changed(monkeypatch):
    """A checkpoint writes only the chunks of rows that have changed."""
    monkeypatch.setattr(buffers, "CHUNK_BYTES", 4 * 28)  # 28 bytes: two observations, an action and 3 numbers
    buffer = replay(size=10)
    add(buffer, [1, 2], [True, True])
    first = set(buffer.changed)
    buffer.changed.clear()
    add(buffer, [3, 4], [True, True])
    add(buffer, [5, 6], [True, False])

    assert buffer.chunk_rows == 4
    assert (first, buffer.changed) == ({0}, {0, 1})


def test_without_faults_a_rollout_is_what_stable_baselines_computes():
    """Without faults, a run must learn exactly as with plain Stable-Baselines3."""
    plan = ([1.0, 0.5, -1.0, 2.0], [True] * 4, [True, False, True, False])
    ours, theirs = rollout(*plan), rollout(*plan, kind=RolloutBuffer)
    for buffer in (ours, theirs):
        buffer.compute_returns_and_advantage(torch.tensor([7.0]), np.array([False]))

    assert ours.advantages.tolist() == theirs.advantages.tolist()
    assert ours.returns.tolist() == theirs.returns.tolist()


def test_the_row_before_an_invalid_one_is_bootstrapped_with_the_state_they_share():
    """The advantage is r + gamma V(s') - V(s), so no value from after the fault is used."""
    buffer = rollout([1.0, 123.0, 5.0], [True, False, True], [True, False, True])

    buffer.compute_returns_and_advantage(torch.tensor([7.0]), np.array([False]))

    assert buffer.advantages[0, 0] == pytest.approx(1.0 + 0.9 * 2.0 - 1.0)
    assert buffer.advantages[1, 0] == 0.0
    assert buffer.advantages[2, 0] == pytest.approx(5.0 + 0.9 * 7.0 - 3.0)


def test_an_invalid_row_at_the_end_of_a_rollout_is_no_different():
    """After the last row, the first value of the next episode is known, but it must not be used."""
    buffer = rollout([1.0, 123.0], [True, False], [True, False])

    buffer.compute_returns_and_advantage(torch.tensor([7.0]), np.array([True]))

    assert buffer.advantages[0, 0] == pytest.approx(1.0 + 0.9 * 2.0 - 1.0)


@given(st.lists(st.booleans(), min_size=1, max_size=20), st.integers(1, 7))
def test_minibatches_hold_every_valid_row_once_and_no_other(valid, batch_size):
    """An empty minibatch would have NaN as its mean."""
    buffer = rollout([0.0] * len(valid), valid, [False] * len(valid))
    buffer.compute_returns_and_advantage(torch.tensor([0.0]), np.array([False]))

    batches = list(buffer.get(batch_size))

    seen = sorted(float(it) for batch in batches for it in batch.old_values)
    assert seen == [row + 1.0 for row, is_valid in enumerate(valid) if is_valid]
    assert all(0 < len(batch.old_values) <= batch_size for batch in batches)


def test_a_rollout_is_read_several_times():
    """PPO reads the rollout once per epoch."""
    buffer = rollout([0.0] * 4, [True, False, True, True], [False] * 4)
    buffer.compute_returns_and_advantage(torch.tensor([0.0]), np.array([False]))

    sizes = [sum(len(batch.old_values) for batch in buffer.get()) for _ in range(3)]

    assert sizes == [3, 3, 3]


def test_an_emptied_rollout_has_forgotten_its_faults():
    """The marks of the last rollout must not apply to rows of the next one."""
    buffer = rollout([0.0] * 2, [False, False], [False] * 2)

    buffer.reset()

    assert buffer.valid.all()
