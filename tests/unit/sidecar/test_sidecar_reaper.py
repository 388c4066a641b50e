"""The reaper as the sidecar uses it: a process with a pipe for commands and a pipe for reports.

A reaper adopts and kills all children of its process, so it cannot run in the process of a test.
"""

import contextlib
import ctypes
import errno
import os
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from palaestra_sim.sidecar import reaper

WAITS = "trap '' TERM; echo ready; sleep 600 & wait; wait"


class Reaper:
    """A running reaper of `/bin/sh -c SCRIPT`, or of another program."""

    def __init__(self, *arguments: str) -> None:
        (theirs, self.commands), (reports, report), (output, out) = os.pipe(), os.pipe(), os.pipe()
        ends = {0: theirs, 1: out, reaper.REPORTS: report}
        self.pid = os.posix_spawn(
            sys.executable,
            [sys.executable, "-m", "palaestra_sim.sidecar.reaper", *arguments],
            os.environ,
            file_actions=[(os.POSIX_SPAWN_DUP2, ours, number) for number, ours in ends.items()],
            setsid=True,
        )
        for end in ends.values():
            os.close(end)
        self.reports, self.output = os.fdopen(reports), os.fdopen(output)

    def send(self, command: bytes) -> None:
        """Send one command."""
        os.write(self.commands, command)

    def abandon(self) -> None:
        """Close the pipe for commands, as the end of the sidecar does."""
        os.close(self.commands)
        self.commands = -1

    def ended(self) -> list[str]:
        """Return the reports up to the end of the reaper, without its first report `started PID`."""
        reports = [line.strip() for line in self.reports]
        os.waitpid(self.pid, 0)
        return [report for report in reports if not report.startswith("started ")]

    def close(self) -> None:
        """End the reaper and its processes, and close the pipes."""
        if self.commands >= 0:
            self.abandon()
        with contextlib.suppress(ChildProcessError):
            os.waitpid(self.pid, 0)
        self.reports.close()
        self.output.close()


@pytest.fixture
def reaped():
    """Yield a function that starts a reaper of a shell script."""
    made = []

    def start(script, *, program="/bin/sh"):
        made.append(Reaper(program, "-c", script))
        return made[-1]

    yield start
    for each in made:
        each.close()


def test_the_start_and_the_wait_status_are_reported(reaped):
    """The sidecar writes the exit code of the simulator into its status."""
    it = reaped("echo $$; exit 7")

    first = it.reports.readline()

    assert first == f"started {it.output.readline()}"
    assert it.ended() == [f"exit {7 << 8}"]


def test_a_program_that_cannot_be_run_is_an_error_with_its_number(reaped):
    """From the number the sidecar gets the reason, such as a missing file; exit code 127 does not show it."""
    it = reaped("", program="/nonexistent/simulator")

    assert sorted(it.ended()) == [f"error {errno.ENOENT}", f"exit {127 << 8}"]


def test_a_simulator_may_end_itself_at_a_request(reaped):
    """Webots saves its world at SIGTERM, and the signal reaches each process of its group."""
    it = reaped("trap 'exit 5' TERM; echo ready; sleep 600 & wait")
    it.output.readline()

    it.send(reaper.TERMINATE)

    assert it.ended() == [f"exit {5 << 8}"]


def test_a_simulator_that_ignores_the_request_runs_until_it_is_killed(reaped):
    """The sidecar decides how long the simulator may take, so the reaper does not kill it by itself."""
    it = reaped(WAITS)
    it.output.readline()
    it.send(reaper.TERMINATE)

    it.send(reaper.KILL)

    assert it.ended() == ["exit 9"]


def test_the_end_of_the_sidecar_kills_the_simulator(reaped):
    """A sidecar that was killed cannot send a command, but the kernel closes its pipe."""
    it = reaped(WAITS)
    it.output.readline()

    it.abandon()

    assert it.ended() == ["exit 9"]


def test_no_process_is_left_when_the_exit_is_reported(reaped):
    """A descendant in a session of its own would keep the port that the next simulator needs."""
    it = reaped("setsid sh -c 'echo $$; exec sleep 600' & wait")
    orphan = int(it.output.readline())

    it.send(reaper.KILL)

    assert it.ended() == ["exit 9"]
    assert not Path(f"/proc/{orphan}").exists()


def test_orphans_end_with_the_first_process(reaped):
    """The first process is the simulator. After its end, its remaining processes serve no client."""
    it = reaped("setsid sleep 600 & echo $!; exit 3")
    orphan = int(it.output.readline())

    assert it.ended() == [f"exit {3 << 8}"]
    assert not Path(f"/proc/{orphan}").exists()


def test_a_reaper_whose_sidecar_has_ended_still_ends_the_simulator(reaped):
    """The reaper reports to its sidecar. If this report fails, the reaper must still do its work."""
    it = reaped(WAITS)
    pid = int(it.reports.readline().split()[1])
    it.output.readline()
    it.reports.close()

    it.abandon()
    _, status = os.waitpid(it.pid, 0)

    assert status == 0
    assert not Path(f"/proc/{pid}").exists()


def test_a_system_without_subreapers_is_an_error(monkeypatch):
    """Without adoption, descendants of a simulator could outlive it unnoticed."""
    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: SimpleNamespace(prctl=lambda *_: -1))

    with pytest.raises(OSError, match="PR_SET_CHILD_SUBREAPER"):
        reaper.adopt_orphans()
