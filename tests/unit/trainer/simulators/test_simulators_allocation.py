"""Each simulator of PALAESTRA_CONFIG is allocated to one environment in one process."""

from __future__ import annotations

import errno
import multiprocessing
import os
import signal
from concurrent.futures import ProcessPoolExecutor

import pytest

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import parse
from palaestra_trainer.simulators.allocation import allocate
from tests.failing import failing

LONG_S = 60


def make_configuration(*roles):
    """Return a configuration whose simulators s-0, s-1 and so on have these roles."""
    simulators = [
        {"name": f"s-{index}", "group": "s", "index": index, "role": role, "control": f"127.0.0.1:710{index}"}
        for index, role in enumerate(roles)
    ]
    return parse(
        {"job": "allocation", "environment": {"id": "Task-v0"}, "steps": 1, "simulators": simulators}
    )


@pytest.fixture(autouse=True)
def scratch(tmp_path, monkeypatch):
    """Let the scratch folder of the container be the test's folder."""
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path))
    return tmp_path


@pytest.fixture
def take():
    """Yield a function that allocates a simulator and returns its name; all are released at the end."""
    allocated = []

    def next_name(configuration, role="Collect"):
        allocated.append(allocate(configuration, role))
        return allocated[-1].simulator.name

    yield next_name
    for allocation in allocated:
        allocation.lock.release()


def test_each_environment_has_a_simulator_of_its_own(take):
    """Two environments in one simulator would drive the same robot, with plausible results."""
    configuration = make_configuration("Collect", "Collect")

    assert [take(configuration), take(configuration)] == ["s-0", "s-1"]


def test_a_collecting_environment_never_takes_an_evaluating_simulator(take):
    """Training in the same simulator would change the results of an evaluation."""
    configuration = make_configuration("Evaluate", "Collect")

    assert take(configuration) == "s-1"
    with pytest.raises(ConfigurationError, match="1 of 2 simulators have role Collect"):
        take(configuration)
    assert take(configuration, "Evaluate") == "s-0"


def test_a_released_simulator_can_be_allocated_again():
    """AsyncVectorEnv makes an environment to read its spaces, and closes it before the workers start."""
    configuration = make_configuration("Collect")
    first = allocate(configuration, "Collect")

    first.lock.release()
    first.lock.release()

    second = allocate(configuration, "Collect")
    assert second.simulator.name == "s-0"
    second.lock.release()


def _allocate_and_name(configuration, folder=None):
    if folder is not None:  # a server process that starts workers has the variables of an earlier test
        os.environ["ROS_LOG_DIR"] = str(folder)
    try:
        return allocate(configuration, "Collect").simulator.name
    except ConfigurationError:
        return None


def _allocate_and_die(configuration):
    allocate(configuration, "Collect")
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.parametrize("method", ["fork", "forkserver", "spawn"])
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_worker_processes_have_simulators_of_their_own(take, method, scratch):
    """Each start method of a process is tested. A forked worker must not share the lock of its parent."""
    configuration = make_configuration("Collect", "Collect")
    mine = take(configuration)

    with ProcessPoolExecutor(1, multiprocessing.get_context(method)) as worker:
        theirs = worker.submit(_allocate_and_name, configuration, scratch).result(LONG_S)
        assert (mine, theirs) == ("s-0", "s-1")
        with pytest.raises(ConfigurationError, match="each has an environment"):
            take(configuration)


@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_forked_worker_does_not_release_its_parents_simulator():
    """A forked worker inherits the environments of its parent, and may close them when it ends."""
    configuration = make_configuration("Collect")
    mine = allocate(configuration, "Collect")

    with ProcessPoolExecutor(1, multiprocessing.get_context("fork")) as worker:
        worker.submit(mine.lock.release).result(LONG_S)
        assert worker.submit(_allocate_and_name, configuration).result(LONG_S) is None

    assert mine.lock.held
    mine.lock.release()


def test_a_killed_process_leaves_no_lock(take):
    """The kernel releases the lock, so a later attempt can use every simulator."""
    configuration = make_configuration("Collect")
    killed = multiprocessing.get_context("spawn").Process(target=_allocate_and_die, args=(configuration,))
    killed.start()
    killed.join(LONG_S)

    assert killed.exitcode == -signal.SIGKILL
    assert take(configuration) == "s-0"


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_scratch_folder_without_locks_is_named(monkeypatch, scratch, number):
    """Without locks, two environments could use the same simulator.

    NFS without its lock service and Lustre without `flock` have no locks.
    """
    monkeypatch.setattr("fcntl.lockf", failing(number))

    with pytest.raises(ConfigurationError) as refused:
        allocate(make_configuration("Collect"), "Collect")

    assert str(refused.value).startswith(f"{scratch}/palaestra-claim-")
    assert f"({os.strerror(number)}); set ROS_LOG_DIR to a folder on a local disk" in str(refused.value)


def test_a_scratch_folder_that_cannot_be_written_is_named(monkeypatch, scratch):
    """A person may have set the variable to a folder that does not exist."""
    monkeypatch.setenv("ROS_LOG_DIR", str(scratch / "missing"))

    with pytest.raises(ConfigurationError, match=r"missing/palaestra-claim.*ROS_LOG_DIR"):
        allocate(make_configuration("Collect"), "Collect")
