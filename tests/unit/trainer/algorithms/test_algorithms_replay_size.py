"""The size of a replay buffer is computed before the buffer is made."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium import spaces
from stable_baselines3.common.buffers import BaseBuffer

from palaestra_trainer.algorithms.buffers import ValidDictReplayBuffer, ValidReplayBuffer
from palaestra_trainer.algorithms.replay_size import ReplaySize, replay_size
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.testing.fake_task import ACTIONS, OBSERVATIONS

SUPPORTED = {name: space for name, space in OBSERVATIONS.items() if name != "Tuple"}
WIDE = {"float64": spaces.Box(-1.0, 1.0, (3,), np.float64)}


def size_of(observation, action, rows=100, steps=10_000):
    """Return the size of a buffer with this number of rows."""
    algorithm = Algorithm(name="SAC", hyperparameters={"buffer_size": rows})
    return replay_size(algorithm, observation, action, steps)


@pytest.mark.parametrize("action", (ACTIONS | WIDE).values(), ids=ACTIONS | WIDE)
@pytest.mark.parametrize("observation", (SUPPORTED | WIDE).values(), ids=SUPPORTED | WIDE)
def test_the_size_is_that_of_the_buffer_itself(observation, action):
    """The test compares every type of space, because the computation is separate from the buffer's code."""
    cls = ValidDictReplayBuffer if isinstance(observation, spaces.Dict) else ValidReplayBuffer
    buffer: BaseBuffer = cls(100, observation, action, device="cpu")

    assert size_of(observation, action).memory_bytes == sum(
        column.nbytes for column in buffer.rows().values()
    )


def test_images_with_stable_baselines3_s_default_need_18_gb():
    """The run would exceed the memory of most pods, which is why the size is computed."""
    image = spaces.Box(0, 255, (48, 64, 3), np.uint8)

    size = size_of(image, spaces.Box(-1, 1, (2,), np.float32), rows=1_000_000, steps=2_000_000)

    assert round(size.memory_bytes / 1e9, 1) == 18.5


def test_rows_that_the_run_cannot_fill_need_no_memory():
    """NumPy takes memory for a row only when the row is written."""
    assert size_of(spaces.Discrete(2), spaces.Discrete(2), rows=1_000_000, steps=50).rows == 50


def test_algorithms_without_replay_and_refused_spaces_have_no_size():
    """PPO has no replay buffer, and a refused space gets a message of its own later."""
    on_policy = replay_size(Algorithm(name="PPO"), spaces.Discrete(2), spaces.Discrete(2), 100)

    assert (on_policy, size_of(OBSERVATIONS["Tuple"], ACTIONS["Box"])) == (None, None)


@pytest.mark.parametrize(("every_steps", "bytes_"), [(10, 100 + 3 * 10), (100, 400), (5000, 400)])
def test_checkpoints_share_rows_that_did_not_change(every_steps, bytes_):
    """Three checkpoints are kept, and a fourth exists while it is written."""
    assert ReplaySize(rows=100, row_bytes=1).disk_bytes(every_steps, keep=3) == bytes_


@pytest.mark.parametrize("every_steps", [1, 7, 40, 1000])
@pytest.mark.parametrize("disk", [3, 50, 100, 400])
def test_the_largest_buffer_fits_and_one_row_more_does_not(every_steps, disk):
    """A person gets this size as the remedy, so it must fit and be as large as possible.

    The test covers the limit by disk space; the limit by memory is a plain division.
    """
    most = ReplaySize(rows=1, row_bytes=1).most_rows(10_000, disk, every_steps, keep=3)

    assert ReplaySize(rows=most, row_bytes=1).disk_bytes(every_steps, 3) <= disk
    assert ReplaySize(rows=most + 1, row_bytes=1).disk_bytes(every_steps, 3) > disk
