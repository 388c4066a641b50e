"""Fixtures that build job files: a test names only the fields that its claim needs."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from palaestra.api import validate
from palaestra.errors import SpecErrors
from tests.jobs import changed, make_job

_GROUPS = [{"name": "collect", "role": "Collect"}, {"name": "evaluate", "role": "Evaluate"}]


def _job_data(changes: dict[str, Any] | None = None) -> dict[str, Any]:
    """Return a job as plain data. A change maps a dotted path in `spec` to its new value."""
    data = make_job("reach", simulators=_GROUPS)
    for path, value in (changes or {}).items():
        data = changed(data, f"spec.{path}", value)
    return data


@pytest.fixture(scope="session")
def job_data() -> Callable[..., dict[str, Any]]:
    """`job_data({"trainer.steps": 0})` returns the data of a job with that change."""
    return _job_data


@pytest.fixture(scope="session")
def problems() -> Callable[..., list[str]]:
    """`problems({"trainer.steps": 0})` returns the problems of a job with that change."""

    def tell(changes: dict[str, Any]) -> list[str]:
        try:
            validate(_job_data(changes))
        except SpecErrors as error:
            return list(error.problems)
        return []

    return tell


@pytest.fixture(scope="session")
def repository() -> Path:
    """Return the root of the checkout."""
    return Path(__file__).parents[3]
