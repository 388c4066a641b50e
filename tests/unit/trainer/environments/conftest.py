"""Environments on the fake robot: those of the arena, and a user's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import pytest

from palaestra_trainer.environments import MoveToTargetEnv
from palaestra_trainer.environments.make import make_environment
from palaestra_trainer.job.configuration import Environment
from palaestra_trainer.simulators.entry_point import make
from palaestra_trainer.testing import fake_arena
from tests.unit.trainer.environments.hall import NAME


@pytest.fixture
def make_env() -> Callable[..., MoveToTargetEnv]:
    """Make an environment on a fake robot.

    The robot dies at the steps `deaths`; other keywords are options.
    """

    def with_options(deaths: tuple[int, ...] = (), **options: Any) -> MoveToTargetEnv:
        return make(*fake_arena(deaths), **options)

    return with_options


@pytest.fixture
def register():
    """Return a function that registers a class under `Hall-v0` until the end of the test."""

    def as_hall(creator, **options):
        gymnasium.register(id=NAME, entry_point=creator, **options)

    yield as_hall
    gymnasium.registry.pop(NAME, None)


@pytest.fixture
def made(register):
    """Register a class, and make the environment as a run makes it."""

    def make(creator, registration=(), **task):
        register(creator, **dict(registration))
        return make_environment(Environment(id=NAME, **task), *fake_arena())

    return make
