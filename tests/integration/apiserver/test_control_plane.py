"""The control plane of the tests itself: it comes in seconds, and nothing of it is left behind."""

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from palaestra.cluster import connect
from tests.waiting import eventually

ROOT = Path(__file__).parents[3]
PROGRAMS = {"etcd", "kube-apiserver", "kube-controller-manager"}


def children(pid):
    """Return the programs that a process started, by process id."""
    found = {}
    for status in Path("/proc").glob("[0-9]*/status"):
        try:
            lines = dict(line.split(":\t", 1) for line in status.read_text().splitlines())
            program = status.with_name("exe").readlink().name
        except OSError:  # it has ended meanwhile
            continue
        if lines["PPid"] == str(pid):
            found[int(status.parent.name)] = program
    return found


def gone(pid):
    """Whether no process of this id runs any more."""
    try:
        return "State:\tZ" in Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return True


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL], ids=lambda end: end.name)
def test_nothing_of_it_outlives_the_one_who_started_it(control_plane, end):
    """`python -m tests.control_plane`, ended in each way that there is."""
    assert control_plane.kubeconfig.exists()
    owner = subprocess.Popen(
        [sys.executable, "-m", "tests.control_plane"], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    kubeconfig = owner.stdout.readline().strip().partition("=")[2]
    connected = connect(kubeconfig)
    assert connected.version()
    connected.close()
    # Each begins as another program, which sees to it that it ends with its owner.
    started = eventually(lambda: set((found := children(owner.pid)).values()) == PROGRAMS and found)

    owner.send_signal(end)
    owner.wait(30)
    owner.stdout.close()
    ends = time.monotonic() + 10
    while not all(map(gone, started)) and time.monotonic() < ends:
        time.sleep(0.05)  # nobody tells a stranger that a process has ended

    assert all(map(gone, started))
    assert Path(kubeconfig).exists() == (end == signal.SIGKILL)
    if end == signal.SIGKILL:
        shutil.rmtree(Path(kubeconfig).parent)
