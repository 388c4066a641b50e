"""Environments on the fake robot."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from palaestra_trainer.environments import MoveToTargetEnv
from palaestra_trainer.simulators.entry_point import make
from palaestra_trainer.testing import fake_arena


@pytest.fixture
def make_env() -> Callable[..., MoveToTargetEnv]:
    """Make an environment on a fake robot.

    The robot dies at the steps `deaths`; other keywords are options.
    """

    def with_options(deaths: tuple[int, ...] = (), **options: Any) -> MoveToTargetEnv:
        return make(*fake_arena(deaths), **options)

    return with_options
