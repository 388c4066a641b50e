"""How tests run: their order, threads, time in unit tests, what is skipped, and the format of the log."""

import gc
import os
from collections.abc import Generator, Iterator

import pytest
import structlog
from hypothesis import HealthCheck, settings

from tests.control_plane.programs import REQUIRED, NoPrograms

# Networks of this size learn faster on one thread than on several, which wait for each other; read by torch.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# A property is not about time, and machines are noisy: --durations shows slow tests.
settings.register_profile("explore", deadline=None, suppress_health_check=[HealthCheck.too_slow])
# The same examples each time: a random example must not fail an unrelated change.
settings.register_profile("repeat", settings.get_profile("explore"), derandomize=True)
settings.load_profile("repeat")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what takes longest, so that no worker is left alone with it at the end."""
    items.sort(key=_minutes, reverse=True)


def pytest_collection_finish() -> None:
    """Let garbage collections pass over what is imported and collected by now: it stays, and it is much."""
    gc.freeze()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup() -> Generator[None]:
    """Skip what needs programs of a cluster where they are not built: a fixture need not think of it."""
    return (yield from _skipped_without_programs())


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Generator[None]:
    """Skip it too where a test asks for them itself."""
    return (yield from _skipped_without_programs())


@pytest.fixture(autouse=True)
def logs_as_before() -> Iterator[None]:
    """Let no test read another's format of the log: programs that run in a test's process set it."""
    before = structlog.get_config()
    yield
    structlog.configure(**before)


def _skipped_without_programs() -> Generator[None]:
    try:
        return (yield)
    except NoPrograms as missing:
        if os.environ.get(REQUIRED) == "1":
            raise
        pytest.skip(str(missing))


def _minutes(item: pytest.Item) -> float:
    mark = item.get_closest_marker("minutes")
    return mark.args[0] if mark else 0
