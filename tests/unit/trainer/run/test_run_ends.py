"""The end of a run: exit codes, the termination message, signals and the watchdog."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import threading

import pytest
import structlog

from palaestra_protocol.pod.status import Cause, ExitCode, Termination
from palaestra_trainer.errors import (
    ConfigurationError,
    Diverged,
    FaultBudgetSpent,
    MasterLost,
    SimulatorDead,
    SimulatorHung,
)
from palaestra_trainer.run.signals import Interrupted, Interruption
from palaestra_trainer.run.telemetry.logs import configure_logs, last_lines
from palaestra_trainer.run.telemetry.progress import Progress
from palaestra_trainer.run.termination import end_of, write_last_word
from palaestra_trainer.run.watchdog import Watchdog, stalled


@pytest.mark.parametrize(
    ("error", "code", "reason"),
    [
        (Interrupted("SIGTERM received"), 75, "Interrupted"),
        (MasterLost("gone"), 75, "MasterLost"),
        (ConfigurationError("steps: 0"), 2, "ConfigurationWrong"),
        (FaultBudgetSpent("x"), 80, "SimulatorBudgetSpent"),
        (Diverged("NaN"), 81, "Diverged"),
        (SimulatorHung("x", "slow"), 82, "SimulatorHung"),
        (SimulatorDead("x", "gone"), 1, "SimulatorUnavailable"),
        (OSError(errno.ENOSPC, "full", "run/x"), 1, "StorageFull"),
        (OSError(errno.ENOSPC, "full"), 1, "StorageFull"),
        (RuntimeError("bug"), 1, "Unexpected"),
    ],
)
def test_every_end_has_its_code(error, code, reason):
    """The operator decides by the exit code whether to retry."""
    end = end_of(error)

    assert (end.code, end.reason) == (code, reason)


def test_the_last_word_goes_where_it_is_wanted(tmp_path):
    """On a laptop, the message goes to a file of the run; in a pod, to the path that Kubernetes reads."""
    path, default = tmp_path / "word", tmp_path / "termination-log"
    word = Termination(step=5, reason="Completed")
    default.touch()

    write_last_word(word, {"PALAESTRA_TERMINATION_LOG": str(path)}, default)
    write_last_word(word, {}, default)

    assert Termination.from_message(path.read_text()) == word
    assert Termination.from_message(default.read_text()) == word


def test_a_last_word_nobody_wants_is_not_written(tmp_path):
    """On a laptop, a trainer must not write a file into /dev."""
    write_last_word(Termination(step=5, reason="Completed"), {}, tmp_path / "none")

    assert list(tmp_path.iterdir()) == []


def test_a_last_word_that_cannot_be_written_is_no_error(tmp_path):
    """The run has ended already, so its exit code must not change."""
    missing = {"PALAESTRA_TERMINATION_LOG": str(tmp_path / "none" / "word")}

    write_last_word(Termination(step=5, reason="Completed"), missing)

    assert list(tmp_path.iterdir()) == []


def test_a_signal_is_noted_and_raised_at_the_next_check():
    """In the middle of a rollout, the state of a model is inconsistent."""
    with Interruption() as interruption:
        interruption.check()
        os.kill(os.getpid(), signal.SIGTERM)

        with pytest.raises(Interrupted, match="SIGTERM received"):
            interruption.check()
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_the_handler_that_was_set_before_is_set_again():
    """The process may have a handler of its own; pytest, for example, installs one."""
    before = signal.getsignal(signal.SIGINT)

    with Interruption():
        assert signal.getsignal(signal.SIGINT) is not before

    assert signal.getsignal(signal.SIGINT) is before


def test_a_sigint_that_was_ignored_at_the_start_stays_ignored():
    """A shell script ignores SIGINT for the programs that it starts in the background."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with Interruption() as interruption:
            os.kill(os.getpid(), signal.SIGINT)
            interruption.check()
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
            assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_stall_is_reported_and_ends_the_process():
    """A process that hangs does nothing by itself, so the watchdog ends it after the deadline."""
    left, words = threading.Event(), []
    codes = []

    def leave(code):
        codes.append(code)
        left.set()

    with Watchdog(lambda: 1.0, 0.2, lambda: words.append("last"), leave):
        assert left.wait(5.0)

    assert (codes, words) == ([ExitCode.STALLED], ["last"])


def test_a_run_that_moves_is_left_alone():
    """A run that makes progress must not end, however often the watchdog looks."""
    asked = threading.Semaphore(0)

    def idle_s():
        asked.release()
        return 0.0

    with Watchdog(idle_s, 0.05, pytest.fail, pytest.fail):
        assert all(asked.acquire(timeout=5.0) for _ in range(3))


def test_a_stalled_process_shows_its_stacks_and_exits_with_82():
    """Only the stacks show where the process hangs."""
    program = (
        "import threading; from palaestra_trainer.run.watchdog import Watchdog\n"
        "def hang(): threading.Event().wait(60)\n"
        "with Watchdog(lambda: 9.0, 0.1, lambda: None): hang()\n"
    )

    ended = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False
    )

    assert ended.returncode == 82
    assert "in hang" in ended.stderr


def test_a_full_disk_is_reported_also_when_the_system_names_no_file():
    """The error of a failed write has only a file descriptor, and no path."""
    end = end_of(OSError(errno.ENOSPC, "full"))

    assert end.message == "the run directory: disk full; free some space"


@pytest.fixture
def progress():
    """Return the progress of a run with started simulators, 90 s after its last step."""
    now = [0.0]
    made = Progress(100, [("collect-0", "Collect"), ("evaluate-0", "Evaluate")], lambda: now[0])
    made.started("collect-0")
    made.started("evaluate-0")
    now[0] = 90.0
    return made


def test_a_stall_while_a_simulator_is_down_is_that_simulator_s(progress):
    """The message names the simulator, so a person reads the simulator's log and not the trainer's."""
    progress.fault("collect-0", SimulatorHung("collect-0", "no answer"), steps_lost=0)

    end = stalled(progress)

    assert (end.code, end.reason) == (82, "SimulatorHung")
    assert end.message == "no environment step for 90 s while starting; not ready: collect-0"


def test_a_stall_amid_a_step_is_a_simulator_s_as_well(progress):
    """During a step, it is not known which of the simulators hangs."""
    with progress.spending(Cause.TRANSPORT):
        end = stalled(progress)

    assert end.reason == "SimulatorHung"
    assert end.message == "no environment step for 90 s while training; a simulator's step does not end"


@pytest.mark.parametrize(("cause", "phase"), [(Cause.LEARNING, "training"), (Cause.CHECKPOINTING, "saving")])
def test_a_stall_while_nobody_waits_for_simulators_is_the_trainer_s(progress, cause, phase):
    """The disk may hang or an update may never end, so a restart of a simulator would not help."""
    with progress.spending(cause):
        end = stalled(progress)

    assert (end.code, end.reason) == (82, "Stalled")
    assert end.message == f"no environment step for 90 s while {phase}"


@pytest.fixture
def log(capsys):
    """Return a logger with the configuration of a trainer."""
    configure_logs()
    yield structlog.get_logger("tests")
    capsys.readouterr()


def test_the_last_ten_lines_of_the_log_are_kept(log, capsys):
    """The termination message has these lines, for a person without access to the log."""
    for number in range(12):
        log.info("line", number=number)

    shown = capsys.readouterr().err.splitlines()
    assert last_lines() == tuple(shown[-10:])
    assert last_lines()[-1].endswith("line number=11")


def test_of_an_error_the_end_of_its_traceback_is_kept(log):
    """The last lines of a traceback have the cause."""

    def fail():
        raise ZeroDivisionError("a bug")

    try:
        fail()
    except ZeroDivisionError:
        log.exception("unexpected error")

    assert last_lines()[-1] == "ZeroDivisionError: a bug"
    assert "in fail" in "".join(last_lines())
