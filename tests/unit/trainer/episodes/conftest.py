"""Several simulators as one VecEnv."""

from __future__ import annotations

import pytest

from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.simulators.restarter import Restarter


@pytest.fixture
def make_vec_env():
    """Yield a function that makes a VecEnv of simulators; the fixture closes it after the test."""
    made = []

    def make(*members, limit=None, run_seed=1, **options):
        restarters = [Restarter(member, limit) for member in members]
        env = SimulatorsVecEnv(restarters, run_seed, **options)
        made.append(env)
        return env

    yield make
    for env in made:
        env.close()
