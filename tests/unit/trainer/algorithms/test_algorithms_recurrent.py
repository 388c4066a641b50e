"""RecurrentPPO: its sequences have no invalid rows, and the LSTM state is reset after them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import torch
from gymnasium import spaces
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.algorithms import ModelPolicy, check, make_model
from palaestra_trainer.algorithms.recurrent import (
    ValidRecurrentDictRolloutBuffer,
    ValidRecurrentRolloutBuffer,
)
from palaestra_trainer.episodes.evaluation import evaluate
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.simulators.restarter import Restarter

NUMBER = spaces.Box(-1e6, 1e6, (1,), np.float32)
HYPERPARAMETERS = {"n_steps": 8, "batch_size": 4, "policy_kwargs": {"net_arch": [4], "lstm_hidden_size": 4}}
BUFFERS = {
    ValidRecurrentRolloutBuffer: NUMBER,
    ValidRecurrentDictRolloutBuffer: spaces.Dict({"mark": NUMBER}),
}


class States:
    """LSTM states of one unit, all equal to the number of a row."""

    def __init__(self, row, members):
        self.pi = self.vf = (torch.full((1, members, 1), float(row)),) * 2


def filled(kind, valid, starts):
    """Return a full buffer.

    An observation is the number of its row, plus 100 for each simulator before its own.
    """
    rows, members = valid.shape
    buffer = kind(rows, BUFFERS[kind], spaces.Discrete(2), (rows, 1, members, 1), "cpu", n_envs=members)
    for row in range(rows):
        marks = (row + 100.0 * np.arange(members))[:, None].astype(np.float32)
        seen = {"mark": marks} if isinstance(BUFFERS[kind], spaces.Dict) else marks
        buffer.mark(valid[row])
        zeros = torch.zeros(members)
        buffer.add(
            seen,
            np.zeros(members),
            np.zeros(members),
            starts[row],
            zeros,
            zeros,
            lstm_states=States(row, members),
        )
    buffer.compute_returns_and_advantage(torch.zeros(members), np.zeros(members, bool))
    return buffer


def drawn(batches):
    """Return the marks of all rows that are learned from, by batch."""
    found = []
    for batch in batches:
        seen = batch.observations["mark"] if isinstance(batch.observations, dict) else batch.observations
        found.append(seen[batch.mask > 0].flatten().tolist())
    return found


@pytest.mark.parametrize("kind", BUFFERS)
@given(data=st.data())
def test_each_valid_row_is_learned_from_once_and_no_other(kind, data):
    """One row has no standard deviation, so a batch has at least two, whatever the batch size."""
    rows, members = data.draw(st.integers(2, 9)), data.draw(st.integers(1, 3))
    marks = data.draw(st.lists(st.booleans(), min_size=rows * members, max_size=rows * members))
    valid = np.array(marks).reshape(rows, members)
    valid[:2, 0] = True
    starts = np.vstack([np.ones((1, members)), ~valid[:-1] & valid[1:]])

    batches = drawn(filled(kind, valid, starts).get(data.draw(st.integers(2, 8))))

    wanted = [row + 100.0 * member for row, member in np.argwhere(valid)]
    assert sorted(mark for batch in batches for mark in batch) == sorted(wanted)
    assert min(map(len, batches)) > 1


def test_a_sequence_begins_anew_after_invalid_rows():
    """The LSTM state that a broken simulator left has no meaning."""
    valid = np.array([[True], [True], [False], [False], [True], [True]])
    starts = np.array([[1], [0], [0], [0], [1], [0]], np.float32)

    batch = next(filled(ValidRecurrentRolloutBuffer, valid, starts).get())

    begun = {
        mark: begins
        for mark, begins, is_row in zip(
            batch.observations.flatten().tolist(),
            batch.episode_starts.tolist(),
            batch.mask.tolist(),
            strict=True,
        )
        if is_row
    }
    assert begun == {0.0: 1.0, 1.0: 0.0, 4.0: 1.0, 5.0: 0.0}


@pytest.fixture
def model(make_member):
    """Return a model whose first simulator dies twice."""
    members = [make_member("collect-0", steps=(3, 12)), make_member("collect-1")]
    wanted = Algorithm(name="RecurrentPPO", hyperparameters=HYPERPARAMETERS)
    check(wanted)
    return make_model(wanted, SimulatorsVecEnv([Restarter(member) for member in members], 1), seed=1)


def mended(rows):
    """Return whether an episode begins at each of the first simulator's restarts.

    A restart is the first valid row after invalid rows.
    """
    pairs = pairwise(rows)
    return [starts[0] for (before, _), (valid, starts) in pairs if valid[0] and not before[0]]


def test_the_memory_restarts_with_the_first_valid_row(model):
    """The last row before the restart ends an episode, so an episode begins with the next row."""
    rows = []

    def note(locals_, _):
        valid = [info["palaestra"]["valid"] for info in locals_["infos"]]
        rows.append((valid, locals_["self"]._last_episode_starts.tolist()))
        return True

    while len(mended(rows)) < 2:
        model.learn(16, note, reset_num_timesteps=False)

    assert all(mended(rows))
    assert all(bool(tensor.isfinite().all()) for tensor in model.policy.parameters())


def test_an_evaluation_keeps_the_memory_of_an_episode(model, make_member):
    """The LSTM state lasts from step to step, but not from one episode to the next."""
    first, again = (evaluate(ModelPolicy(model), make_member(), [seed]) for seed in (5, 5))
    both = evaluate(ModelPolicy(model), make_member(), [3, 5])

    assert first.episodes == again.episodes == both.episodes[1:]
