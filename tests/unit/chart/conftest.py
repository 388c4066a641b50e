"""The chart's objects in each mode, rendered by Helm; the tests are skipped where Helm is not built."""

from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

from tests.chart.helm import objects
from tests.chart.modes import MODES
from tests.control_plane.programs import programs

Object = dict[str, Any]


@pytest.fixture(scope="session", autouse=True)
def helm_is_built() -> None:
    """Every test of this folder needs Helm."""
    programs(("helm",))


@pytest.fixture(scope="session")
def made() -> Callable[[str], list[Object]]:
    """Return all objects of a mode."""
    return cache(lambda mode: objects(MODES[mode]))


@pytest.fixture
def one(made) -> Callable[..., Object]:
    """Return the only object of a kind and a name in a mode."""

    def find(mode: str, kind: str, name: str = "palaestra-operator") -> Object:
        [found] = [each for each in made(mode) if (each["kind"], each["metadata"]["name"]) == (kind, name)]
        return found

    return find
