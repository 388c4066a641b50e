"""The configuration of test runs: order, threads, time limits, skipped tests and log format."""

import fcntl
import gc
import os
import sys
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import structlog
from hypothesis import HealthCheck, settings
from xdist.remote import Producer
from xdist.scheduler import LoadFileScheduling

from tests import skipped, surroundings
from tests.control_plane.programs import REQUIRED, NoPrograms

# PyTorch reads this variable. Networks of this size train faster on one thread than on several.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# Property tests have no deadline, because a busy machine slows them. `--durations` shows slow tests.
settings.register_profile("explore", deadline=None, suppress_health_check=[HealthCheck.too_slow])
# Every run draws the same examples, because a new random example must not fail an unrelated change.
settings.register_profile("repeat", settings.get_profile("explore"), derandomize=True, max_examples=40)
settings.load_profile("repeat")
# Files that one worker runs one after another, by path prefix.
TOGETHER = (
    ("tests/integration/chart/",),  # these files share a control plane with Prometheus' and Kueue's kinds
    (  # these files add Kueue's kinds to the shared control plane, and remove them again
        "tests/integration/operator/test_operator_queues.py",
        "tests/integration/operator/test_operator_refusals.py",
    ),
)
COMPILED = Path(__file__).parent / "__pycache__" / "compiled"  # shows that each test module was compiled


def pytest_configure(config: pytest.Config) -> None:
    """Give a process that runs tests the signals, locale and limits of `tests.surroundings`.

    The controller of pytest-xdist runs no tests, so its settings stay as they are.
    """
    if hasattr(config, "workerinput") or not config.getoption("numprocesses", None):
        surroundings.settle()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection() -> Generator[None]:
    """Let one worker compile tests and libraries on a new clone, and let the others read the result.

    Otherwise every worker compiles everything, which takes a minute. Garbage collection is off during the
    imports, because imported modules stay in memory and the collector would find nothing to free.
    """
    with _compiled_by_one():
        gc.disable()
        try:
            return (yield)
        finally:
            gc.enable()


@contextmanager
def _compiled_by_one() -> Iterator[None]:
    if COMPILED.exists() or sys.dont_write_bytecode:
        yield
        return
    COMPILED.parent.mkdir(exist_ok=True)
    with COMPILED.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if COMPILED.exists():
            fcntl.flock(lock, fcntl.LOCK_UN)
        yield
        COMPILED.touch()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print one line for each reason to skip tests, instead of one line for each skipped test."""
    reports = terminalreporter.getreports("skipped")
    reasons = [report.longrepr[2].removeprefix("Skipped: ") for report in reports]
    if reasons:
        terminalreporter.section("skipped")
        for line in skipped.lines(reasons):
            terminalreporter.line(line)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> LoadFileScheduling:
    """Give each worker whole files, and all files of a group to one worker."""
    return _ByFile(config, log)


class _ByFile(LoadFileScheduling):
    def _split_scope(self, nodeid: str) -> str:
        together = [group for group in TOGETHER if nodeid.startswith(group)]
        return together[0][0] if together else super()._split_scope(nodeid)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the longest tests, so that no worker runs a long test after the others have finished."""
    items.sort(key=_minutes, reverse=True)


def pytest_collection_finish() -> None:
    """Exclude modules and test items from garbage collection, because they are many and stay in memory."""
    gc.freeze()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup() -> Generator[None]:
    """Skip a test if its fixtures need programs of a cluster that are not built."""
    return (yield from _skipped_without_programs())


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Generator[None]:
    """Skip a test if its body needs programs of a cluster that are not built."""
    return (yield from _skipped_without_programs())


@pytest.fixture(autouse=True)
def logs_as_before() -> Iterator[None]:
    """Reset the log format after each test, because programs in the process of a test change it."""
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
