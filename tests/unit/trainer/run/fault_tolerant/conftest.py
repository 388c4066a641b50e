"""Environment groups of fake simulators."""

from __future__ import annotations

import pytest

from palaestra_trainer.run.fault_tolerant.env_group import EnvGroup
from palaestra_trainer.simulators.budget import RestartLimit
from palaestra_trainer.simulators.restarter import Restarter, settle


@pytest.fixture
def make_players():
    """Yield a function that makes groups of simulators.

    A group's `rows` has the rows of its steps, and `released` has an item for each release.
    """
    made = []

    def make(*members, restarts=10, **options):
        restarters = [Restarter(member, RestartLimit(restarts=restarts)) for member in members]
        rows, released = [], []

        def release():
            settle(restarters)
            released.append(1)

        players = EnvGroup(restarters, release, played=rows.append, **options)
        players.rows, players.released = rows, released
        made.append(players)
        return players

    yield make
    for players in made:
        players.close()
