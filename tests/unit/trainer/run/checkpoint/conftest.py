"""Small models that a test trains, saves and resumes."""

from __future__ import annotations

import pytest

from palaestra_trainer.algorithms import buffers, make_model
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.simulators.restarter import Restarter
from tests.unit.trainer.run.checkpoint.trained_model import CHUNK_ROWS, HYPERPARAMETERS, Trained


@pytest.fixture
def small_chunks(monkeypatch):
    """Make chunks of a few dozen rows, so that a small buffer has several.

    A row of the corridor has 36 bytes.
    """
    monkeypatch.setattr(buffers, "CHUNK_BYTES", 36 * CHUNK_ROWS)


@pytest.fixture
def trained(small_chunks, make_member, make_configuration, tmp_path):
    """Return a function that trains a model for some steps."""
    del small_chunks

    def make(name="DQN", steps=40):
        configuration = make_configuration(algorithm={"name": name, "hyperparameters": HYPERPARAMETERS[name]})
        env = SimulatorsVecEnv([Restarter(make_member())], run_seed=1)
        model = make_model(configuration.algorithm, env, seed=1)
        made = Trained(model, env, configuration, tmp_path / "checkpoints")
        return made.learn(steps) if steps else made

    return make
