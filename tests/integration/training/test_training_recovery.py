"""Restarts of a real simulator that was killed or stopped, or whose sidecar was killed."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from palaestra.local.ports import LOOPBACK, HeldPorts
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import SimulatorDead
from palaestra_trainer.simulators.budget import RestartLimit
from palaestra_trainer.simulators.entry_point import make
from palaestra_trainer.simulators.interface import NullWatcher
from palaestra_trainer.simulators.restarter import Restarter, await_one, settle
from palaestra_trainer.simulators.simulator import Simulator
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher
from palaestra_trainer.webots.launching.sidecar import Sidecar
from tests.waiting import eventually

STAND = np.zeros(1, dtype=np.int64)
PATIENCE_S = 60.0


class Restarts(NullWatcher):
    """A watcher that counts restarts."""

    def __init__(self):
        self.count = 0

    def restarted(self, simulator, *, recycled):
        """Count the restart."""
        del simulator, recycled
        self.count += 1


class Trained:
    """One running simulator in a vector environment.

    Attributes:
        restarter: restarts the simulator.
        restarts: counts the restarts.
    """

    def __init__(self, sidecar):
        self._sidecar = sidecar
        self.restarts = Restarts()
        simulator = Simulator("collect-0", sidecar, make, 20.0)
        self.restarter = Restarter(simulator, RestartLimit(restarts=20), self.restarts)
        self.restarter.begin_start()
        await_one([self.restarter])
        assert self.restarter.up()
        self.env = SimulatorsVecEnv([self.restarter], 0)
        self.env.reset()
        self.step()

    @property
    def pid(self):
        """Return the simulator's process id."""
        return self._sidecar.state().pid

    def step(self):
        """Take a step; return whether its row is valid, and the info."""
        _, _, _, (info,) = self.env.step(STAND)
        return info["palaestra"]["valid"], info

    def break_by(self, number):
        """Send a signal to the simulator, and return the resulting fault."""
        os.kill(self.pid, number)
        return self.fault()

    def fault(self):
        """Take steps until the simulator has a fault, and return the fault."""
        while (info := self.step()[1])["palaestra"]["valid"]:
            pass
        return info["palaestra"]["sim_fault"]

    def go_on(self):
        """Take steps until a row is valid again."""
        eventually(lambda: self.step()[0], PATIENCE_S)

    def close(self):
        """Close the environment, and stop the simulator."""
        self.env.close()
        self.restarter.stop()


@pytest.fixture
def train(master):
    """Yield a function that returns a running simulator, with a given sidecar or a new one."""
    del master
    made = []

    def begin(sidecar=None, options=()):
        launcher = None if sidecar else ProcessLauncher("arena", options=options)
        made.append((Trained(sidecar or launcher), launcher))
        return made[-1][0]

    yield begin
    for trained, launcher in made:
        trained.close()
        if launcher is not None:
            launcher.close()


def test_a_killed_simulator_is_played_in_again(train):
    """A bus error, or a kill by the kernel for too much memory, ends a simulator in the same way."""
    trained = train()

    fault = trained.break_by(signal.SIGKILL)

    assert fault["kind"] == "dead"
    trained.go_on()
    assert trained.restarts.count == 1


def test_a_stopped_simulator_is_noticed(train):
    """The socket of a stopped process stays open, so only a timeout shows the fault."""
    trained = train()

    fault = trained.break_by(signal.SIGSTOP)

    assert fault["kind"] == "hung"
    trained.go_on()


def test_faults_leave_no_thread_no_descriptor_and_no_process(train):
    """A week of training has thousands of faults, so even a small leak would end the training."""
    trained = train()
    trained.break_by(signal.SIGKILL)
    trained.go_on()
    before = left()

    for _ in range(10):
        trained.break_by(signal.SIGKILL)
        trained.go_on()

    assert trained.restarts.count == 11
    eventually(lambda: left() == before, PATIENCE_S)  # a master's call to our node may still be open


def left():
    """Return the names of threads, and the numbers of descriptors and child processes, of this process."""
    for thread in threading.enumerate():
        if thread.name.startswith("restarter-"):
            thread.join(PATIENCE_S)
    descriptors = list(Path("/proc/self/fd").iterdir())
    tasks = Path("/proc/self/task").iterdir()
    children = []
    for task in tasks:
        with contextlib.suppress(OSError):  # the thread has ended meanwhile
            children += (task / "children").read_text().split()
    return sorted(thread.name for thread in threading.enumerate()), len(descriptors), len(children)


def test_ending_amid_a_start_waits_for_nobody(train):
    """A simulator may need a minute to start, but the pod must end sooner."""
    trained = train(options=["--fault=slow_start:start=2,latency_ms=600000"])
    trained.break_by(signal.SIGKILL)

    settle([trained.restarter])

    assert not trained.restarter.busy


class OwnSidecar:
    """A sidecar that keeps its address after a restart, as in a container."""

    def __init__(self):
        self._ports = HeldPorts()
        self.address = f"{LOOPBACK}:{self._ports.any()}"
        self.process = None

    def start(self):
        """Start the sidecar, as a kubelet does."""
        self.process = subprocess.Popen(
            [
                Path(sys.executable).with_name("palaestra-sidecar"),
                "--driver=stub",
                "--world=arena",
                f"--control={self.address}",
                "--health=127.0.0.1:0",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def kill(self):
        """Kill the sidecar; its simulator ends with it."""
        self.process.kill()
        self.process.wait(PATIENCE_S)

    def end(self):
        """Kill the sidecar, and release its port."""
        self.kill()
        self._ports.close()


@pytest.fixture
def own_sidecar():
    """Yield a sidecar; the test may kill it and start it again."""
    own = OwnSidecar()
    own.start()
    yield own
    own.end()


def test_a_sidecar_that_is_gone_is_waited_for(train, own_sidecar):
    """A kubelet restarts the sidecar within a minute, but ten attempts would be spent within a second."""
    trained = train(Sidecar(f"http://{own_sidecar.address}", "collect-0"))
    own_sidecar.kill()
    assert trained.fault()["kind"] == "dead"
    assert trained.restarter.busy
    with pytest.raises(SimulatorDead):
        trained.restarter.member.sidecar.state()

    own_sidecar.start()

    trained.go_on()
    assert trained.restarts.count == 1


def test_ending_does_not_wait_for_a_sidecar_that_is_gone(train, own_sidecar):
    """The sidecar may be gone because the pod ends."""
    trained = train(Sidecar(f"http://{own_sidecar.address}", "collect-0"))
    own_sidecar.kill()
    trained.fault()

    trained.close()

    assert not trained.restarter.busy
