"""All processes of a simulator end with the simulator or the sidecar, in whatever way either ends."""

import http.client
import os
import shutil
import signal
import subprocess

import pytest

from palaestra_protocol.control import LastExit, SidecarState
from palaestra_sim.sidecar.reaper import children
from palaestra_sim.sidecar.signals import SHUTDOWN_S
from palaestra_sim.sidecar.simulator import SHUTDOWN_GRACE_S
from tests.integration.sidecar.conftest import DEADLINE_S, ENDS

IN_A_NAMESPACE = ["unshare", "--pid", "--fork", "--mount-proc", "--kill-child"]


def namespaces_work():
    """Return whether this machine permits a new pid namespace."""
    if shutil.which("unshare") is None:
        return False
    return subprocess.run([*IN_A_NAMESPACE, "true"], capture_output=True, check=False).returncode == 0


as_process_1 = pytest.mark.skipif(not namespaces_work(), reason="no pid namespace may be made here")


def test_a_simulator_takes_its_family_along(sidecar, family, left, eventually_true) -> None:
    """A child process that has left the simulator's group and session, and lost its parent, must end too."""
    it = sidecar(family)
    it.start()
    eventually_true(lambda: len(left()) == 6)  # sidecar, reaper, simulator and its three children

    it.request("/stop", {"deadline_s": 0})
    it.until(SidecarState.IDLE)

    eventually_true(lambda: left() == {it.process.pid})


def test_a_simulator_that_dies_takes_its_family_along(sidecar, family, left, eventually_true) -> None:
    """A worker that stays would keep the ROS name and the graphics card."""
    it = sidecar(family)
    pid = it.start().pid

    os.kill(pid, signal.SIGKILL)
    failed = it.until(SidecarState.FAILED)

    assert failed.last_exit == LastExit(code=None, signal="SIGKILL", expected=False)
    eventually_true(lambda: left() == {it.process.pid})


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("what", ["waits", "stubborn", "family"])
def test_a_signal_ends_everything(sidecar, request, left, eventually_true, number, what) -> None:
    """If the machine is too busy for the normal end, an alarm ends the sidecar."""
    it = sidecar(request.getfixturevalue(what))
    it.start()

    assert it.end(number) in ENDS
    eventually_true(lambda: not left())


def test_the_end_takes_less_than_two_seconds() -> None:
    """Sidecars that stop last in a pod have only two seconds.

    First the simulator gets SIGKILL, and later the alarm ends the sidecar.
    """
    assert SHUTDOWN_GRACE_S < SHUTDOWN_S < 2


def test_a_signal_ends_a_sidecar_whose_simulator_does_not_run(sidecar, waits) -> None:
    """Without a simulator, the sidecar has no process to wait for."""
    assert sidecar(waits).end() == 0


def test_a_signal_during_a_stop_does_not_wait_for_its_deadline(sidecar, stubborn) -> None:
    """The trainer may have set a long deadline, but the container must end soon."""
    it = sidecar(stubborn)
    it.start()
    it.request("/stop", {"deadline_s": 3600})

    assert it.end() in ENDS


def test_a_simulator_gets_the_chance_to_end_by_itself(sidecar, ends) -> None:
    """After SIGTERM, Webots' launcher removes its temporary files, so SIGKILL must come later."""
    it = sidecar(
        ends("signal.signal(signal.SIGTERM, lambda *_: (print('bye'), sys.exit(0)))\nsignal.pause()")
    )
    it.start()
    it.until_said("up")

    it.end()

    it.until_said("bye")


@pytest.mark.parametrize("what", ["waits", "stubborn", "family"])
def test_a_killed_sidecar_leaves_no_process(sidecar, request, left, eventually_true, what) -> None:
    """A killed sidecar cannot act, but its reaper notices the end of the pipe."""
    it = sidecar(request.getfixturevalue(what))
    it.start()

    assert it.end(signal.SIGKILL) == -signal.SIGKILL
    eventually_true(lambda: not left())


def test_a_killed_reaper_is_a_fault_and_leaves_no_process(sidecar, family, left, eventually_true) -> None:
    """The kernel makes the reaper's processes children of the sidecar, which must end them."""
    it = sidecar(family)
    it.start()
    (reaper,) = children({it.process.pid})

    os.kill(reaper, signal.SIGKILL)
    failed = it.until(SidecarState.FAILED)

    assert failed.detail.startswith(
        "the simulator ended: the reaper of the simulator ended before the simulator"
    )
    eventually_true(lambda: left() == {it.process.pid})
    assert it.start().starts == 2


def test_a_sidecar_whose_log_nobody_reads_still_ends(arguments, ends, left, eventually_true) -> None:
    """A full pipe blocks every write, so the sidecar must be able to end without a write."""
    source, sink = os.pipe()
    program = "while True: print('x' * 1000)"
    process = subprocess.Popen(arguments(ends(program)), stdout=sink, stdin=subprocess.DEVNULL)
    os.close(sink)
    with os.fdopen(source, "rb", buffering=0) as log:
        line = log.readline().decode()
        host, port = line.partition("control=")[2].split()[0].split(":")
        connection = http.client.HTTPConnection(host, int(port), timeout=10)
        connection.request("POST", "/start", "{}")
        assert connection.getresponse().status == 200
        connection.close()
        eventually_true(lambda: len(left()) == 3)

        process.send_signal(signal.SIGTERM)
        process.wait(DEADLINE_S)

        eventually_true(lambda: not left())


@pytest.fixture
def inside():
    """Return a function that returns the outer pid of a sidecar that is process 1 in a namespace."""
    return lambda it: next(iter(children({it.process.pid})))


@as_process_1
def test_process_1_reaps_the_orphans_of_the_container(sidecar, waits, inside, eventually_true) -> None:
    """Only process 1 can reap orphans, such as those of a shell that a user opens in the container."""
    it = sidecar(waits, before=IN_A_NAMESPACE)
    it.start()
    before = children({inside(it)})

    enter = ["nsenter", "--target", str(inside(it)), "--pid", "sh", "-c"]
    subprocess.run([*enter, "(sleep 0 & sleep 0 &) & exit"], check=True, timeout=20)

    eventually_true(lambda: children({inside(it)}) == before)
    assert it.state.state is SidecarState.STARTING


@as_process_1
@pytest.mark.parametrize("what", ["waits", "stubborn", "family"])
def test_process_1_ends_by_sigterm_as_any_other(
    sidecar, request, left, eventually_true, inside, what
) -> None:
    """The kernel delivers to process 1 only signals for which it has a handler."""
    it = sidecar(request.getfixturevalue(what), before=IN_A_NAMESPACE)
    it.start()

    os.kill(inside(it), signal.SIGTERM)

    assert it.process.wait(DEADLINE_S) in ENDS
    eventually_true(lambda: not left())
