"""Fixtures that render the chart with Helm in each mode; where Helm is not built, the tests are skipped."""

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
    """Skip every test of this folder if Helm is not built."""
    programs(("helm",))


@pytest.fixture(scope="session")
def made() -> Callable[[str], list[Object]]:
    """Return a function that returns all objects of a mode."""
    return cache(lambda mode: objects(MODES[mode]))


@pytest.fixture
def one(made) -> Callable[..., Object]:
    """Return a function that returns the only object of a kind and a name in a mode."""

    def find(mode: str, kind: str, name: str = "palaestra-operator") -> Object:
        [found] = [each for each in made(mode) if (each["kind"], each["metadata"]["name"]) == (kind, name)]
        return found

    return find
