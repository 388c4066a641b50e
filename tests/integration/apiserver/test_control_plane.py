"""The tests' own control plane starts in seconds and leaves no process or file."""

import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from palaestra.cluster import connect
from tests.control_plane.programs import programs
from tests.waiting import eventually

ROOT = Path(__file__).parents[3]
FIRST = {"etcd", "kube-apiserver"}
PROGRAMS = {*FIRST, "kube-controller-manager"}


def children(pid):
    """Return the child processes of a process: the name of the program by process id."""
    found = {}
    for status in Path("/proc").glob("[0-9]*/status"):
        try:
            lines = dict(line.split(":\t", 1) for line in status.read_text().splitlines())
            program = status.with_name("exe").readlink().name
        except OSError:  # the process has ended meanwhile
            continue
        if lines["PPid"] == str(pid):
            found[int(status.parent.name)] = program
    return found


def gone(pid):
    """Return whether the process with this id has ended."""
    try:
        return "State:\tZ" in Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return True


def owner(*arguments):
    """Start a module of tests.control_plane, by default its main program; skip if it is not built."""
    programs()
    module = ".".join(("tests.control_plane", *arguments[:1]))
    command = [sys.executable, "-m", module, *arguments[1:]]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)


def all_gone(pids):
    """Wait up to ten seconds, and return whether all these processes have ended.

    The function polls, because the kernel does not notify a process about processes of others.
    """
    ends = time.monotonic() + 10
    while not all(map(gone, pids)) and time.monotonic() < ends:
        time.sleep(0.05)
    return all(map(gone, pids))


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGINT], ids=lambda end: end.name)
def test_nothing_of_it_is_left_when_it_is_asked_to_end(end):
    """A user ends `python -m tests.control_plane` with Ctrl-C, and must find no process or file of it."""
    with owner() as process:
        kubeconfig = process.stdout.readline().strip().partition("=")[2]
        connected = connect(kubeconfig)
        assert connected.version()
        connected.close()
        # Each process starts as a wrapper that sets its end with its owner. Wait for the real programs.
        started = eventually(lambda: set((found := children(process.pid)).values()) == PROGRAMS and found)
        process.send_signal(end)
        process.wait(30)

    assert all_gone(started)
    assert not Path(kubeconfig).exists()


def test_no_process_of_it_outlives_a_killed_owner():
    """The owner may be killed at any time. This test kills it just after the start of the API server."""
    with owner() as process:
        started = eventually(lambda: set((found := children(process.pid)).values()) >= FIRST and found)
        etcd = next(pid for pid, program in started.items() if program == "etcd")
        folder = re.search(r"--data-dir=(.+)/etcd", Path(f"/proc/{etcd}/cmdline").read_text())[1]
        process.kill()

    assert all_gone(started)
    shutil.rmtree(folder)


def test_the_control_plane_of_a_run_ends_with_the_run_however_that_ends(tmp_path):
    """If pytest is killed, no worker can end the control plane."""
    folder = tmp_path / "plane"
    folder.mkdir()
    with ExitStack() as stack:
        run = stack.enter_context(subprocess.Popen(["sleep", "600"]))
        stack.callback(run.kill)
        restarter = stack.enter_context(owner("shared", str(folder), str(run.pid)))
        started = eventually(lambda: set((found := children(restarter.pid)).values()) >= FIRST and found)
        run.kill()
        run.wait()
        restarter.wait(60)

    assert all_gone(started)
    assert not folder.exists()
