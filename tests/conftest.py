"""How tests run: their order, threads, time in unit tests, what is skipped, and the format of the log."""

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

# Networks of this size learn faster on one thread than on several, which wait for each other; read by torch.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# A property is not about time, and machines are noisy: --durations shows slow tests.
settings.register_profile("explore", deadline=None, suppress_health_check=[HealthCheck.too_slow])
# The same examples each time, as a random one must not fail an unrelated change; so a few are enough.
settings.register_profile("repeat", settings.get_profile("explore"), derandomize=True, max_examples=40)
settings.load_profile("repeat")
# Files that one worker runs one after another, by the beginnings of their paths.
TOGETHER = (
    ("tests/integration/chart/",),  # one control plane, with Prometheus' and Kueue's kinds
    (  # with and without Kueue's kinds, on the control plane that all share
        "tests/integration/operator/test_operator_queues.py",
        "tests/integration/operator/test_operator_refusals.py",
    ),
)
COMPILED = Path(__file__).parent / "__pycache__" / "compiled"  # marks that each test module was compiled


def pytest_configure(config: pytest.Config) -> None:
    """Make tests independent of where they were started; a process that waits for workers stays as it is."""
    if hasattr(config, "workerinput") or not config.getoption("numprocesses", None):
        surroundings.settle()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection() -> Generator[None]:
    """Let one worker compile tests and libraries on a new clone, and the others read what it wrote.

    Else each of them compiles all, for a minute. What is imported stays, so no garbage is collected either.
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
    """Say what was skipped, and how to run it, in a line or two instead of hundreds."""
    reports = terminalreporter.getreports("skipped")
    reasons = [report.longrepr[2].removeprefix("Skipped: ") for report in reports]
    if reasons:
        terminalreporter.section("skipped")
        for line in skipped.lines(reasons):
            terminalreporter.line(line)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> LoadFileScheduling:
    """Give each worker whole files, and one of them all files of a group."""
    return _ByFile(config, log)


class _ByFile(LoadFileScheduling):
    def _split_scope(self, nodeid: str) -> str:
        together = [group for group in TOGETHER if nodeid.startswith(group)]
        return together[0][0] if together else super()._split_scope(nodeid)


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
