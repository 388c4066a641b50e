"""All transitions between the states of a simulator, with real processes."""

import json
import os
import signal

import pytest

from palaestra_protocol.control import LastExit, SidecarState, SimulatorState

IDLE, STARTING, READY, STOPPING, FAILED = SidecarState


def test_a_sidecar_begins_idle_and_starts_nothing_by_itself(sidecar, waits) -> None:
    """The trainer starts its simulators, because it starts several at the same time."""
    state = sidecar(waits).state

    assert (state.state, state.pid, state.starts, state.last_exit) == (IDLE, None, 0, None)


def test_a_life_that_goes_well(sidecar, waits) -> None:
    """A life consists of the requests start, ready and stop, and of the simulator's end.

    Each response must contain the new state.
    """
    it = sidecar(waits)

    pid = it.start().pid
    assert it.state.state is STARTING
    assert it.request("/ready").state is READY
    assert it.request("/stop", {"deadline_s": 60}).state is STOPPING
    os.kill(pid, signal.SIGTERM)
    ended = it.until(IDLE)

    assert ended.last_exit == LastExit(code=None, signal="SIGTERM", expected=True)
    assert (ended.pid, ended.starts, ended.faults) == (None, 1, 0)


def test_the_environment_of_a_simulator_has_the_number_of_its_start(sidecar) -> None:
    """A simulator that fails by chance must not fail at the same step in each life."""
    it = sidecar("import os; print('start', os.environ['PALAESTRA_SIMULATOR_START'])")

    it.request("/start")
    it.until(FAILED)
    it.request("/start")

    it.until_said("start 2")


def test_a_simulator_lets_a_trainer_on_its_processor_go_on(sidecar, waits) -> None:
    """With the normal scheduling policy, a simulator that gets a request would interrupt the trainer."""
    assert os.sched_getscheduler(sidecar(waits).start().pid) == os.SCHED_BATCH


def test_a_start_is_answered_before_the_simulator_is_there(sidecar, waits) -> None:
    """The trainer starts several simulators at once, so a start request must not block."""
    state = sidecar(waits).request("/start")

    assert (state.state, state.starts) == (STARTING, 1)


@pytest.mark.parametrize("ready", [False, True])
@pytest.mark.parametrize(
    ("statement", "how"),
    [
        ("sys.exit(3)", (3, None)),
        ("sys.exit(0)", (0, None)),
        ("os.kill(os.getpid(), signal.SIGBUS)", (None, "SIGBUS")),
        ("os.kill(os.getpid(), signal.SIGKILL)", (None, "SIGKILL")),
        ("os.kill(os.getpid(), 40)", (None, "SIG40")),
    ],
)
def test_an_end_that_nobody_asked_for_is_a_fault(sidecar, ends, tmp_path, statement, how, ready) -> None:
    """A simulator has no reason to end by itself, so every exit code is a fault."""
    os.mkfifo(gate := tmp_path / "gate")
    it = sidecar(ends(f"open(sys.argv[1] + '/gate').read()\n{statement}"))
    it.start()
    if ready:
        it.request("/ready")

    gate.write_text("open")
    failed = it.until(FAILED)

    assert failed.last_exit == LastExit(code=how[0], signal=how[1], expected=False)
    assert (failed.pid, failed.starts, failed.faults) == (None, 1, 1)


def test_a_failure_says_how_it_ended_and_its_last_words(sidecar, ends) -> None:
    """The trainer's /status and a job's message show this text to a user."""
    it = sidecar(ends("sys.exit('cannot open display')"))

    it.request("/start")

    assert it.until(FAILED).detail == ("the simulator ended with code 1; its last line: cannot open display")


def test_a_simulator_that_failed_is_started_again(sidecar, ends, tmp_path) -> None:
    """After a failure, the counts continue, and the rest of the state starts afresh."""
    it = sidecar(ends("os._exit(4) if not os.path.exists(p := sys.argv[1] + '/again') else signal.pause()"))
    it.request("/start")
    it.until(FAILED)
    (tmp_path / "again").touch()

    state = it.start()

    assert (state.state, state.starts, state.faults, state.detail) == (STARTING, 2, 1, "")


def test_a_stopped_simulator_is_started_again_with_a_new_process(sidecar, waits) -> None:
    """Recycling stops and starts a simulator, and the sidecar must be able to do so."""
    it = sidecar(waits)
    first = it.start().pid
    it.request("/stop", {"deadline_s": 0})
    it.until(IDLE)

    second = it.start()

    assert second.pid != first
    assert (second.starts, second.faults) == (2, 0)


def test_a_second_start_is_refused_and_starts_nothing(sidecar, waits) -> None:
    """Two simulators with one name would remove each other from the ROS master."""
    it = sidecar(waits)
    pid = it.start().pid

    status, text = it.ask("POST", "/start", {})

    state = SimulatorState.from_json(json.loads(text))
    assert (status, state.starts, state.pid) == (409, 1, pid)


@pytest.mark.parametrize(("path", "body"), [("/ready", {}), ("/stop", {"deadline_s": 1})])
def test_what_an_idle_simulator_cannot_do_is_refused(sidecar, waits, path, body) -> None:
    """The refusal contains the state, so that the trainer sees the cause."""
    it = sidecar(waits)

    status, text = it.ask("POST", path, body)

    assert status == 409
    assert SimulatorState.from_json(json.loads(text)) == it.state


def test_a_stop_with_no_time_kills_at_once(sidecar, stubborn) -> None:
    """A simulator that hangs does not react to SIGTERM."""
    it = sidecar(stubborn)
    it.start()

    it.request("/stop", {"deadline_s": 0})

    assert it.until(IDLE).last_exit == LastExit(code=None, signal="SIGKILL", expected=True)


def test_a_stop_kills_when_its_deadline_has_passed(sidecar, stubborn) -> None:
    """Until the deadline, the simulator may end by the request of the trainer's supervisor."""
    it = sidecar(stubborn)
    it.start()

    it.request("/stop", {"deadline_s": 0.3})
    it.until_said("palaestra-sidecar: stopping: killed at its deadline")

    assert it.until(IDLE).faults == 0


def test_a_second_stop_brings_the_deadline_forward(sidecar, stubborn) -> None:
    """The trainer sets a second deadline when it sees that the supervisor does not respond."""
    it = sidecar(stubborn)
    it.start()
    it.request("/stop", {"deadline_s": 3600})

    it.request("/stop", {"deadline_s": 0})

    assert it.until(IDLE).last_exit.signal == "SIGKILL"


def test_a_second_stop_does_not_put_the_deadline_off(sidecar, stubborn) -> None:
    """The client that set the first deadline relies on that deadline."""
    it = sidecar(stubborn)
    it.start()
    it.request("/stop", {"deadline_s": 0.2})

    it.ask("POST", "/stop", {"deadline_s": 3600})

    assert it.until(IDLE).last_exit.signal == "SIGKILL"


def test_a_program_that_cannot_be_run_is_a_fault_with_its_reason(sidecar, tmp_path) -> None:
    """The file exists when the sidecar checks the command line, but it is not executable code."""
    broken = tmp_path / "broken"
    broken.write_bytes(b"\x7fELF, almost")
    broken.chmod(0o755)
    it = sidecar([str(broken)])

    it.request("/start")
    failed = it.until(FAILED)

    assert failed.detail == "the simulator ended: it could not be run: Exec format error"
    assert failed.last_exit == LastExit(code=None, signal=None, expected=False)
